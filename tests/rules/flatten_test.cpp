// What flatten() writes, read back through the view that the live code reads it with.
#include "rules/prove/flatten.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <random>

#include "rules/prove/compile.hpp"
#include "tests/rules/rules_by_hand.hpp"
#include "tests/support/live_table.hpp"

namespace arbiter::test {
namespace {

using rules::CompiledModel;
using rules::Diagnostics;
using testing::ElementsAre;
using testing::IsEmpty;

std::vector<shm::Word> to_vector(const shm::WordList& list) {
  std::vector<shm::Word> words;
  for (shm::Word i = 0; i < list.count; ++i) words.push_back(list[i]);
  return words;
}

CompiledModel search_and_track() {
  Diagnostics diagnostics;
  return compile(
      RulesByHand()
          .port("/Gaze/pos:i", {{"/RandomLook/pos:o",
                                 all_of({inactive("/Face/pos:o"), inactive("/Object/pos:o")})},
                                {"/Face/pos:o", inactive("/Object/pos:o")},
                                {"/Object/pos:o", inactive("/collision:o")}})
          .port("/Arm/pos:i", {{"/RestArm/pos:o", inactive("/Object/pos:o")},
                               {"/Object/pos:o", inactive("/collision:o")}})
          .other("/camera:o", "/Face/img:i")
          .other("/joystick:o", "/Arm/pos:i")
          .timeout("/collision:o", shm::kForever)
          .timeout("/Face/pos:o", 5'000'000'000),
      diagnostics);
}

// Each field of the compiled model, found again in the table.
void expect_reads_back(const CompiledModel& model) {
  const LiveTable live(model);
  const shm::TableView table = live.view();
  ASSERT_TRUE(table.is_table());
  EXPECT_EQ(table.timeout(shm::kMaxSources - 1), model.timeout);
  for (const auto& source : model.sources) {
    const auto id = live.source_id(source);
    EXPECT_TRUE(table.knows_source(id));
    EXPECT_FALSE(table.knows_source(id + 1)) << "ids between those given are not known";
    const auto own = model.timeouts.find(source);
    EXPECT_EQ(table.timeout(id), own == model.timeouts.end() ? model.timeout : own->second);
  }
  std::map<std::string, std::vector<shm::Word>> links, concerned;
  for (const auto& port : model.ports) {
    const auto id = live.port_id(port.port);
    EXPECT_TRUE(table.knows_port(id));
    EXPECT_FALSE(table.knows_port(id + 1));
    EXPECT_EQ(table.is_arbitrated(id), port.arbitrated);
    std::vector<shm::Word> reads;
    for (const auto& source : port.reads) reads.push_back(live.source_id(source));
    EXPECT_EQ(to_vector(table.sources_read(id)), reads);
    const auto range = table.connections_to(id);
    ASSERT_EQ(range.count, port.rules.size());
    for (shm::Word i = 0; i < range.count; ++i) {
      const auto& expected = port.rules[i];
      const shm::Rule rule = table.rule(range.first + i);
      EXPECT_EQ(rule.source, live.source_id(expected.source));
      EXPECT_EQ(rule.port, id);
      EXPECT_EQ(rule.kind, expected.kind);
      EXPECT_EQ(table.find(rule.source, id), range.first + i);
      links[expected.source].push_back(range.first + i);
      ASSERT_EQ(rule.reads.count, expected.reads.size());
      for (shm::Word r = 0; r < rule.reads.count; ++r) {
        shm::Word word = live.source_id(expected.reads[r]);
        if (expected.kind == shm::table::kConjunction && expected.expected[r]) {
          word |= shm::table::kExpectActive;
        }
        EXPECT_EQ(rule.reads[r], word);
      }
      ASSERT_EQ(rule.nodes.count, expected.nodes.size() * shm::table::kNodeWords);
      for (shm::Word n = 0; n < expected.nodes.size(); ++n) {
        const shm::Word base = n * shm::table::kNodeWords;
        EXPECT_EQ(rule.nodes[base + shm::table::kNodePosition], expected.nodes[n].position);
        EXPECT_EQ(rule.nodes[base + shm::table::kNodeLow], expected.nodes[n].low);
        EXPECT_EQ(rule.nodes[base + shm::table::kNodeHigh], expected.nodes[n].high);
      }
    }
    for (const auto& source : model.sources) {
      const bool is_connected = std::any_of(port.rules.begin(), port.rules.end(),
                                            [&](auto& rule) { return rule.source == source; });
      const bool is_read =
          std::find(port.reads.begin(), port.reads.end(), source) != port.reads.end();
      if (port.arbitrated && (is_connected || is_read)) concerned[source].push_back(id);
    }
  }
  for (const auto& source : model.sources) {
    const auto id = live.source_id(source);
    EXPECT_EQ(to_vector(table.connections_of_source(id)), links[source]);
    EXPECT_EQ(to_vector(table.ports_concerned(id)), concerned[source]) << source;
  }
}

TEST(Flatten, EverythingReadsBack) { expect_reads_back(search_and_track()); }

TEST(Flatten, EverythingOfRandomModelsReadsBack) {
  for (unsigned seed = 0; seed < 50; ++seed) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    std::mt19937 random(seed);
    RulesByHand by_hand;
    const auto name = [&] { return "/s" + std::to_string(random() % 9); };
    for (int p = 0; p < 4; ++p) {
      std::set<std::string> sources;
      while (sources.size() < 1 + random() % 4) sources.insert(name());
      std::vector<std::pair<std::string, ExpressionPtr>> rules;
      for (const auto& source : sources) {
        rules.emplace_back(
            source, binary(random() % 2 == 0 ? Operator::kXor : Operator::kImplies, active(name()),
                           all_of({inactive(name()), active(name())})));
      }
      by_hand.port("/p" + std::to_string(p), rules, true);
    }
    by_hand.timeout("/s0", static_cast<shm::Nanoseconds>(random()) * 1'000'003);
    Diagnostics diagnostics;
    const auto model = compile(by_hand, diagnostics);
    ASSERT_FALSE(diagnostics.has_errors());
    expect_reads_back(model);
  }
}

TEST(Flatten, ASourceThatIsOnlySensedConcernsThePortsThatReadIt) {
  const LiveTable live(search_and_track());
  const auto collision = live.source_id("/collision:o");
  EXPECT_THAT(to_vector(live.view().connections_of_source(collision)), IsEmpty());
  EXPECT_THAT(to_vector(live.view().ports_concerned(collision)),
              ElementsAre(live.port_id("/Arm/pos:i"), live.port_id("/Gaze/pos:i")));
}

TEST(Flatten, ASourceConnectedToPortsWithoutRulesConcernsNone) {
  const LiveTable live(search_and_track());
  const auto camera = live.source_id("/camera:o");
  EXPECT_EQ(live.view().connections_of_source(camera).count, 1u);
  EXPECT_THAT(to_vector(live.view().ports_concerned(camera)), IsEmpty());
}

TEST(Flatten, ConnectionsWithoutARuleComeLast) {
  const LiveTable live(search_and_track());
  const auto range = live.view().connections_to(live.port_id("/Arm/pos:i"));
  const auto last = live.view().rule(range.first + range.count - 1);
  EXPECT_EQ(last.source, live.source_id("/joystick:o"));
  EXPECT_EQ(last.kind, shm::table::kNever);
}

TEST(Flatten, AnEmptyModelIsATable) {
  const LiveTable live(CompiledModel{});
  EXPECT_TRUE(live.view().is_table());
  EXPECT_EQ(live.view().connection_count(), 0u);
}

TEST(Flatten, RefusesATableThatIsTooLarge) {
  CompiledModel model;
  model.sources = {"/a"};
  rules::CompiledPort port{"/p", true, {}, {}};
  rules::CompiledRule rule;
  rule.source = "/a";
  rule.nodes.resize(shm::kMaxTableWords / shm::table::kNodeWords);
  port.rules.push_back(rule);
  model.ports.push_back(port);
  const auto zero = [](const std::string&) { return 0u; };
  EXPECT_THROW(flatten(model, {zero, zero}), std::length_error);
}

TEST(Flatten, RefusesIdsBeyondTheLimits) {
  const auto model = search_and_track();
  const auto zero = [](const std::string&) { return 0u; };
  const auto beyond = [](const std::string&) { return shm::kMaxSources; };
  EXPECT_THROW(flatten(model, {beyond, zero}), std::length_error);
  EXPECT_THROW(flatten(model, {zero, beyond}), std::length_error);
}

}  // namespace
}  // namespace arbiter::test
