// conflict="first" where the rules are decided one after the other, since precedence multiplied out
// would be too large: the same winners, with tables that stay small.
#include "rules/prove/in_order.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <random>

#include "rules/explain/explain.hpp"
#include "rules/explain/simulation.hpp"
#include "rules/prove/flatten.hpp"
#include "rules/prove/table_rules.hpp"
#include "tests/rules/ordered_rules.hpp"
#include "tests/support/live_table.hpp"
#include "tests/support/rounds.hpp"

namespace arbiter::test {
namespace {

using rules::Diagnostics;
using testing::Contains;

const std::vector<std::string> kSixSources = {"/a", "/b", "/c", "/d", "/e", "/f"};

Rules up_to_six_rules(std::mt19937& random) {
  const auto leaf = [](const auto& pick) {
    if (pick(12) == 0) return pick(2) == 0 ? always() : negation(always());
    const auto& source = kSixSources[pick(kSixSources.size())];
    return pick(2) == 0 ? active(source) : inactive(source);
  };
  Rules rules;
  const std::size_t count = 1 + random() % kSixSources.size();
  for (std::size_t i = 0; i < count; ++i) {
    rules.emplace_back(kSixSources[i],
                       random() % 6 == 0 ? always() : random_condition(random, 2, leaf));
  }
  return rules;
}

bool has(const Diagnostics& diagnostics, const std::string& code) {
  return std::any_of(diagnostics.items().begin(), diagnostics.items().end(),
                     [&](const auto& item) { return item.code == code; });
}

// Every reader of a table, against the definition, over all activations.
class Readers {
 public:
  Readers(const Rules& rules, const rules::CompiledModel& model)
      : rules_(rules), model_(model), live_(model) {}

  void check_all_states() {
    for (const auto& now : subsets(kSixSources)) {
      SCOPED_TRACE(testing::PrintToString(now));
      live_.activate_only(now);
      const auto expected = first_that_holds(rules_, now);
      ASSERT_EQ(live_.winners("/p"),
                expected ? std::vector{*expected} : std::vector<std::string>());
      check_arrivals(now);
      check_table(now, expected);
    }
  }

 private:
  // Each counts as active in its own decision.
  void check_arrivals(const Active& now) {
    for (const auto& rule : rules_) {
      Active after = now;
      after.insert(rule.first);
      EXPECT_EQ(live_.delivers(rule.first, "/p"), first_that_holds(rules_, after) == rule.first)
          << rule.first;
    }
  }

  void check_table(const Active& now, const std::optional<std::string>& expected) {
    const auto table = live_.view();
    const auto is_active = [&](shm::SourceId id) { return now.contains(name_of(id)); };
    const shm::SourceId winner = shm::selected_at(table, live_.port_id("/p"), is_active).source;
    EXPECT_EQ(winner == shm::kNone ? std::nullopt : std::optional(name_of(winner)), expected);
    const auto set = rules::rules_of_table(table, live_.port_id("/p"), "/p",
                                           [&](shm::SourceId id) { return name_of(id); });
    const auto explained = rules::Explainer(set).explain(
        "/p", [&](const std::string& source) { return now.contains(source); });
    EXPECT_EQ(explained.winner, expected);
  }

  std::string name_of(shm::SourceId id) const {
    for (const auto& source : model_.sources) {
      if (live_.source_id(source) == id) return source;
    }
    return "";
  }

  const Rules& rules_;
  const rules::CompiledModel& model_;
  LiveTable live_;
};

TEST(InOrder, RandomRulesDecideAsTheDefinitionSays) {
  std::mt19937 random(20261122);
  int in_order = 0;
  for (int round = 0; round < rounds(400); ++round) {
    const Rules rules = up_to_six_rules(random);
    const rules::RuleSet set = RulesByHand().port("/p", rules, true);
    Diagnostics diagnostics;
    const auto model = compile(set, diagnostics, 0);
    ASSERT_FALSE(diagnostics.has_errors());
    EXPECT_EQ(has(diagnostics, "decided-in-order"), model.ports.at(0).in_order);
    in_order += model.ports.at(0).in_order ? 1 : 0;
    SCOPED_TRACE("round " + std::to_string(round));
    Readers(rules, model).check_all_states();
    if (HasFailure()) return;
  }
  EXPECT_GT(in_order, rounds(160));  // about half are; of a tenth, 20 of 40
}

TEST(InOrder, TheSourcesThatAPortReadsAreThoseThatItsWalksTest) {
  std::mt19937 random(7);
  for (int round = 0; round < rounds(100); ++round) {
    Diagnostics diagnostics;
    const auto model =
        compile(RulesByHand().port("/p", up_to_six_rules(random), true), diagnostics, 0);
    const LiveTable live(model);
    const auto table = live.view();
    const auto read = table.sources_read(live.port_id("/p"));
    std::set<shm::SourceId> port_reads;
    for (shm::Word i = 0; i < read.count; ++i) port_reads.insert(read[i]);
    for (shm::ConnectionIndex c = 0; c < table.connection_count(); ++c) {
      const shm::Rule rule = table.rule(c);
      for (shm::Word i = 0; i < rule.reads.count; ++i) {
        EXPECT_THAT(port_reads, Contains(rule.reads[i] & ~shm::table::kExpectActive));
      }
    }
  }
}

class ManyConnections : public testing::TestWithParam<std::size_t> {};

TEST_P(ManyConnections, WithThreeRandomInhibitionsEachLoadAndDecideExactly) {
  const std::size_t count = GetParam();
  for (unsigned seed = 0; seed < 3; ++seed) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    const Rules rules = random_inhibitions(count, seed);
    Diagnostics diagnostics;
    const auto model = compile(RulesByHand().port("/p", rules, true), diagnostics);
    ASSERT_FALSE(diagnostics.has_errors()) << diagnostics.items().front().message;
    EXPECT_LT(rules::largest_table(model) - rules::largest_table({}), 8192u + 20 * count);
    LiveTable live(model);
    std::mt19937 random(seed);
    for (int state = 0; state < 200; ++state) {
      Active now;
      const auto sparse = 1 + random() % 40;
      for (std::size_t i = 0; i < count; ++i) {
        if (random() % sparse == 0) now.insert(numbered_source(i));
      }
      live.activate_only(now);
      const auto expected = first_that_holds(rules, now);
      ASSERT_EQ(live.winners("/p"), expected ? std::vector{*expected} : std::vector<std::string>());
      const std::string arriving = numbered_source(random() % count);
      now.insert(arriving);
      EXPECT_EQ(live.delivers(arriving, "/p"), first_that_holds(rules, now) == arriving);
    }
  }
}

INSTANTIATE_TEST_SUITE_P(, ManyConnections, testing::Values(40, 45, 50, 100, 256),
                         testing::PrintToStringParamName());

TEST(InOrder, ManyPortsThatExplodeLeaveEnoughForTheOthers) {
  RulesByHand by_hand;
  for (int port = 0; port < 12; ++port) {
    by_hand.port("/p" + std::to_string(port), random_inhibitions(100, 1), true);
  }
  by_hand.port("/q", {{"/a", inactive("/b")}, {"/b", always()}});
  Diagnostics diagnostics;
  const auto model = compile(by_hand, diagnostics);
  EXPECT_FALSE(diagnostics.has_errors());
  ASSERT_EQ(model.ports.size(), 13u);
  EXPECT_FALSE(model.ports.back().in_order);
}

TEST(InOrder, PrecedenceThatIsSmallIsStillMultipliedOut) {
  Diagnostics diagnostics;
  const auto model = compile(
      RulesByHand().port("/p", {{"/a", inactive("/c")}, {"/b", always()}}, true), diagnostics);
  EXPECT_FALSE(model.ports.at(0).in_order);
  EXPECT_FALSE(has(diagnostics, "decided-in-order"));
}

}  // namespace
}  // namespace arbiter::test
