// Random models through the whole chain, against the definition of a rule.
#include <gtest/gtest.h>

#include <algorithm>
#include <cstring>

#include "rules/explain/explain.hpp"
#include "rules/model/application_writer.hpp"
#include "rules/model/load.hpp"
#include "rules/prove/compile.hpp"
#include "tests/rules/random_model.hpp"
#include "tests/support/live_table.hpp"
#include "tests/support/rounds.hpp"
#include "tests/support/temporary_directory.hpp"

namespace arbiter::test {
namespace {

const Vocabulary kVocabulary;
const auto& kDrawnFrom = kVocabulary.sources;
const auto& kPorts = kVocabulary.ports;

// How many pairs of connections can win together, by trying all activations.
std::size_t count_conflicts(const NaiveEvaluator& naive) {
  std::set<std::vector<std::string>> pairs;
  for (const auto& port : kPorts) {
    for (const auto& active : subsets(kDrawnFrom)) {
      const auto selected = naive.selected(port, active);
      for (std::size_t j = 1; j < selected.size(); ++j) {
        for (std::size_t i = 0; i < j; ++i) pairs.insert({port, selected[i], selected[j]});
      }
    }
  }
  return pairs.size();
}

class RandomModels : public testing::TestWithParam<bool> {
 protected:
  void check(unsigned seed);
  static void check_decisions(const rules::CompiledModel& model, const NaiveEvaluator& naive);

  int decided_ = 0, refused_ = 0;
};

void RandomModels::check(unsigned seed) {
  const bool first_wins = GetParam();
  const RandomModel random = Generator(seed).model();
  const std::string xml =
      to_xml(random, first_wins ? std::set(kPorts.begin(), kPorts.end()) : std::set<std::string>());
  SCOPED_TRACE("seed " + std::to_string(seed) + "\n" + xml);
  const TemporaryDirectory directory;
  rules::Diagnostics diagnostics;
  const auto set = rules::load({{directory.write("model.xml", xml)}, {}}, diagnostics);
  ASSERT_FALSE(diagnostics.has_errors()) << diagnostics.items().back().message;
  const auto model = rules::compile(set, diagnostics);
  const NaiveEvaluator naive(random);
  const std::size_t expected_conflicts = first_wins ? 0 : count_conflicts(naive);
  const auto found = std::count_if(diagnostics.items().begin(), diagnostics.items().end(),
                                   [](const auto& item) { return item.code == "both-can-win"; });
  EXPECT_EQ(static_cast<std::size_t>(found), expected_conflicts);
  EXPECT_EQ(diagnostics.has_errors(), expected_conflicts > 0);
  ++(expected_conflicts > 0 ? refused_ : decided_);
  if (expected_conflicts > 0) return;
  check_decisions(model, naive);

  // The rules, merged into an application, and that read as model and application in one.
  const auto merged = rules::load(
      {{directory.write("merged.xml", rules::write_application(set, "random"))}, {}}, diagnostics);
  ASSERT_FALSE(diagnostics.has_errors()) << diagnostics.items().back().message;
  EXPECT_TRUE(rules::same_rules(merged, set));
  check_decisions(rules::compile(merged, diagnostics), naive);
}

void RandomModels::check_decisions(const rules::CompiledModel& model, const NaiveEvaluator& naive) {
  LiveTable live(model);
  for (const auto& active : subsets(kDrawnFrom)) {
    live.activate_only(active);
    for (const auto& port : kPorts) {
      if (naive.sources_at(port).empty()) continue;
      auto expected = naive.selected(port, active);
      if (!expected.empty()) expected.resize(1);
      ASSERT_EQ(live.winners(port), expected) << port << ' ' << testing::PrintToString(active);
      for (const auto& source : naive.sources_at(port)) {
        auto after = active;
        after.insert(source);
        const auto selected = naive.selected(port, after);
        EXPECT_EQ(live.delivers(source, port), !selected.empty() && selected.front() == source);
      }
    }
  }
}

// Explanations against the definition: what is said to keep a connection out does so by itself,
// whatever all others do, and nothing that does is left out.
class Explanations {
 public:
  Explanations(const RandomModel& random, const rules::RuleSet& set)
      : naive_(random), explainer_(set) {}

  void check(const std::string& port) {
    for (const auto& active : activations_) {
      SCOPED_TRACE(port + ' ' + testing::PrintToString(active));
      const auto explained = explainer_.explain(
          port, [&](const std::string& source) { return active.contains(source); });
      const auto selected = naive_.selected(port, active);
      EXPECT_EQ(explained.winner.value_or(""), selected.empty() ? "" : selected.front());
      std::vector<std::string> sources;
      for (const auto& connection : explained.connections) {
        sources.push_back(connection.source);
        EXPECT_EQ(connection.wins, explained.winner == connection.source);
        check_reason(port, connection, active);
        check_hypothesis(port, connection, active);
        check_alone(port, connection, active);
        auto with_own = active;  // as in each decision on its arrivals
        with_own.insert(connection.source);
        for (const auto& part : connection.parts) {
          check_part(port, connection.source, part, with_own);
        }
      }
      EXPECT_EQ(sources, naive_.sources_at(port));
    }
  }

  int reasons() const { return reasons_; }

 private:
  static bool agrees(const std::vector<rules::Literal>& literals, const Active& active) {
    return std::all_of(literals.begin(), literals.end(), [&](const rules::Literal& literal) {
      return active.contains(literal.source) == literal.active;
    });
  }

  // To ask for one connection is to ask for all and pick it.
  void check_alone(const std::string& port, const rules::ConnectionExplanation& connection,
                   const Active& active) {
    const auto alone = explainer_.explain_connection(
        port, connection.source,
        [&](const std::string& source) { return active.contains(source); });
    ASSERT_TRUE(alone);
    EXPECT_EQ(alone->source, connection.source);
    EXPECT_EQ(alone->is_active, connection.is_active);
    EXPECT_EQ(alone->wins, connection.wins);
    EXPECT_EQ(alone->earlier, connection.earlier);
    EXPECT_EQ(alone->reason(), connection.reason());
    ASSERT_EQ(alone->parts.size(), connection.parts.size());
    for (std::size_t i = 0; i < alone->parts.size(); ++i) {
      const auto& causes = connection.parts[i].causes;
      EXPECT_TRUE(std::equal(causes.begin(), causes.end(), alone->parts[i].causes.begin(),
                             alone->parts[i].causes.end(), [](const auto& left, const auto& right) {
                               return left.kind == right.kind && left.because == right.because &&
                                      left.also == right.also;
                             }));
    }
  }

  void check_reason(const std::string& port, const rules::ConnectionExplanation& connection,
                    const Active& active) {
    const auto reason = connection.reason();
    ASSERT_EQ(reason.has_value(), !connection.wins);
    if (!reason) return;
    ++reasons_;
    EXPECT_TRUE(agrees(*reason, active));
    for (const auto& other : activations_) {
      if (!agrees(*reason, other)) continue;
      const auto selected = naive_.selected(port, other);
      EXPECT_TRUE(selected.empty() || selected.front() != connection.source)
          << "with " << testing::PrintToString(other);
    }
  }

  // What is not active is told to wait for that only where it would win then.
  void check_hypothesis(const std::string& port, const rules::ConnectionExplanation& connection,
                        const Active& active) {
    auto with_own = active;
    with_own.insert(connection.source);
    const auto selected = naive_.selected(port, with_own);
    const bool may_hold = std::any_of(connection.parts.begin(), connection.parts.end(),
                                      [](const auto& part) { return part.causes.empty(); });
    const bool holds =
        std::find(selected.begin(), selected.end(), connection.source) != selected.end();
    EXPECT_EQ(may_hold, holds) << connection.source;
    EXPECT_EQ(may_hold && !connection.earlier, holds && selected.front() == connection.source);
    if (!connection.earlier) return;
    EXPECT_EQ(*connection.earlier, selected.front());
    for (const auto& other : activations_) {
      if (!other.contains(connection.source) || !agrees(connection.earlier_because, other))
        continue;
      const auto then = naive_.selected(port, other);
      EXPECT_TRUE(!then.empty() && then.front() != connection.source);
    }
  }

  void check_part(const std::string& port, const std::string& own, const rules::Part& part,
                  const Active& active) {
    ASSERT_TRUE(part.behaviour);
    const int behaviour = std::stoi(part.behaviour->name.substr(std::strlen("Element ")));
    std::multiset<std::string> told;
    for (const auto& cause : part.causes) {
      ASSERT_TRUE(cause.of);
      const bool inhibits = cause.kind == rules::Cause::Kind::kInhibited;
      const std::string obstacle = inhibits ? cause.inhibitor->name + " inhibits " + cause.of->name
                                            : "condition of " + cause.of->name;
      told.insert(obstacle);
      EXPECT_TRUE(agrees(cause.because, active));
      for (const auto& other : activations_) {
        if (!other.contains(own) || !agrees(cause.because, other)) continue;
        EXPECT_EQ(naive_.obstacles(behaviour, port, other).count(obstacle) > 0, true) << obstacle;
      }
      const auto by_own = cause.own_activity != rules::Cause::OwnActivity::kNoMatter;
      auto without_own = active;
      without_own.erase(own);
      EXPECT_EQ(by_own, naive_.obstacles(behaviour, port, without_own).count(obstacle) == 0);
      if (!inhibits || by_own) continue;
      // Once all that it names are inactive, and the source itself where that is one of them, the
      // inhibition is over.
      auto after = cause.because.empty() ? without_own : active;
      for (const auto& literal : cause.because) after.erase(literal.source);
      for (const auto& source : cause.also) after.erase(source);
      EXPECT_EQ(naive_.obstacles(behaviour, port, after).count(obstacle), 0u) << obstacle;
    }
    EXPECT_EQ(told, naive_.obstacles(behaviour, port, active));
  }

  const NaiveEvaluator naive_;
  const rules::Explainer explainer_;
  const std::vector<Active> activations_ = subsets(kDrawnFrom);
  int reasons_ = 0;
};

TEST_P(RandomModels, AreExplainedAsTheDefinitionOfARuleSays) {
  int reasons = 0;
  for (unsigned seed = 0; seed < 15; ++seed) {
    const RandomModel random = Generator(seed).model();
    const std::string xml = to_xml(
        random, GetParam() ? std::set(kPorts.begin(), kPorts.end()) : std::set<std::string>());
    SCOPED_TRACE("seed " + std::to_string(seed) + "\n" + xml);
    const TemporaryDirectory directory;
    rules::Diagnostics diagnostics;
    const auto set = rules::load({{directory.write("model.xml", xml)}, {}}, diagnostics,
                                 rules::Keep::kProvenance);
    ASSERT_FALSE(diagnostics.has_errors());
    Explanations explanations(random, set);
    for (const auto& port : set.ports) explanations.check(port.port);
    reasons += explanations.reasons();
    if (HasFailure()) return;
  }
  EXPECT_GT(reasons, rounds(300));
}

TEST_P(RandomModels, DecideAsTheDefinitionOfARuleSays) {
  for (unsigned seed = 0; seed < rounds(300u); ++seed) check(seed);
  EXPECT_GT(decided_, rounds(60));
  EXPECT_EQ(refused_ > rounds(60), !GetParam());
}

INSTANTIATE_TEST_SUITE_P(, RandomModels, testing::Bool(), [](const auto& param_info) {
  return param_info.param ? "WithConflictFirst" : "WithProof";
});

}  // namespace
}  // namespace arbiter::test
