// What check finds beside errors, and that it keeps to its bounds whatever the rules.
#include "rules/ask/findings.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <functional>
#include <random>

#include "rules/prove/compile.hpp"
#include "tests/rules/rules_by_hand.hpp"

namespace arbiter::test {
namespace {

using rules::Diagnostic;
using rules::Diagnostics;
using rules::FindingsAccount;
using testing::Contains;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;

struct Found {
  FindingsAccount account;
  std::uint64_t spent = 0;
  std::vector<Diagnostic> items;

  [[nodiscard]] std::vector<std::string> codes() const {
    std::vector<std::string> result;
    for (const auto& item : items) result.push_back(item.code);
    return result;
  }
};

// What the findings have when a check begins with a whole budget.
constexpr std::uint64_t kFindingsSteps = rules::Budget::kSteps / 5;

Found found_in(const rules::RuleSet& set, std::uint64_t steps = kFindingsSteps) {
  Diagnostics diagnostics;
  const auto model = compile(set, diagnostics);
  EXPECT_FALSE(diagnostics.has_errors());
  Diagnostics more;
  rules::Budget budget(steps);
  const auto account = find_more(set, model, more, budget);
  return {account, budget.spent(), more.items()};
}

std::string numbered(int i) { return "/s" + std::to_string(i); }

TEST(Findings, NothingIsSaidOfPrioritiesThatLeaveNobodyOut) {
  const auto found =
      found_in(RulesByHand().port("/p", {{"/low", inactive("/high")}, {"/high", always()}}));
  EXPECT_THAT(found.items, IsEmpty());
  EXPECT_EQ(found.account.ports, 1u);
}

TEST(Findings, NameAShortestStateWithoutAWinnerAndItsPlace) {
  const auto found = found_in(
      RulesByHand().port("/p", {{"/low", all_of({inactive("/high"), inactive("/off")})},
                                {"/high", all_of({inactive("/stop"), inactive("/off")})}}));
  ASSERT_THAT(found.codes(), ElementsAre("nobody-wins", "starved"));
  EXPECT_EQ(found.items[0].message,
            "with /high and /stop active, nobody wins at /p although /high is connected there and "
            "active (one of 3 such causes); if somebody should win then, connect it in a behaviour "
            "that nothing keeps from running in this state");
  EXPECT_EQ(found.items[0].where.line, 3u);
  const auto& others = found.items[0].more_witnesses;
  ASSERT_EQ(others.size(), 2u);
  EXPECT_THAT(others[0].active, ElementsAre("/high", "/off"));
  EXPECT_THAT(others[1].active, ElementsAre("/low", "/off"));
  EXPECT_EQ(found.items[1].message,
            "at /p, /high silences /low even while /stop silences /high: with /high, /low and "
            "/stop active and /off inactive, nobody wins; if /low should win then, replace "
            "what keeps it out, an inhibition or a part of its condition, by a condition of its "
            "behaviour: \"not /high or /stop\"");
  EXPECT_EQ(found.items[1].where.line, 3u);
}

TEST(Findings, ProposeNoConditionWithWhichBothCouldWin) {
  const auto found = found_in(RulesByHand().port(
      "/p", {{"/low", inactive("/high")}, {"/high", any_of({active("/one"), active("/other")})}}));
  ASSERT_THAT(found.codes(), Contains("starved"));
  for (const auto& item : found.items) {
    if (item.code != "starved") continue;
    EXPECT_THAT(item.message, HasSubstr("behaviour that fails only where /high wins"));
  }
}

TEST(Findings, NameOfThoseSilencedTheOneThatTheStateIsAbout) {
  const auto found = found_in(RulesByHand().port(
      "/p", {{"/far", all_of({inactive("/high"), active("/a"), inactive("/near")})},
             {"/near", inactive("/high")},
             {"/high", inactive("/stop")}}));
  ASSERT_THAT(found.codes(), Contains("starved"));
  EXPECT_THAT(
      found.items.back().message,
      HasSubstr("with /high, /near and /stop active, nobody wins; if /near should win then"));
}

// What first models get wrong: the inhibitor is active, but its own condition is not fulfilled.
TEST(Findings, NameWhoSilencesOthersWhileItsConditionFails) {
  const auto found = found_in(
      RulesByHand().port("/p", {{"/low", inactive("/high")}, {"/high", active("/enable")}}));
  ASSERT_THAT(found.codes(), ElementsAre("nobody-wins", "starved"));
  EXPECT_EQ(
      found.items[1].message,
      "at /p, /high silences /low even while /high cannot win for want of /enable: with "
      "/high and /low active and /enable inactive, nobody wins; if /low should win then, "
      "replace what keeps it out, an inhibition or a part of its condition, by a condition of "
      "its behaviour: \"not /high or not /enable\"");
  EXPECT_EQ(found.items[1].where.line, 3u);
}

TEST(Findings, SourcesThatKeepEachOtherOutAreACircle) {
  const auto found = found_in(RulesByHand().port(
      "/p", {{"/a", inactive("/b")}, {"/b", inactive("/c")}, {"/c", inactive("/a")}}));
  ASSERT_THAT(found.codes(), testing::Contains("inhibition-circle"));
  EXPECT_EQ(found.items[0].severity, rules::Severity::kWarning);
  EXPECT_EQ(found.items[0].message,
            "at /p, /a is kept out by /b and /b is kept out by /c and /c is kept out by /a, in a "
            "circle: while they are active, and nobody else that is connected there, nobody wins; "
            "let one of them win then, by an inhibition or a condition less, or if that is meant, "
            "say so in a statement (--assert)");
}

TEST(Findings, ACircleThatAConditionBreaksIsNone) {
  const auto found =
      found_in(RulesByHand().port("/p", {{"/a", any_of({inactive("/b"), active("/first")})},
                                         {"/b", all_of({inactive("/a"), inactive("/first")})}}));
  EXPECT_THAT(found.codes(), testing::Not(testing::Contains("inhibition-circle")));
}

TEST(Findings, EachCauseOfNobodyIsToldWhereverItLies) {
  const auto found =
      found_in(RulesByHand().port("/p", {{"/low", all_of({inactive("/mid"), inactive("/top")})},
                                         {"/mid", all_of({active("/enable"), inactive("/top")})},
                                         {"/top", inactive("/fault")}}));
  ASSERT_THAT(found.codes(), ElementsAre("nobody-wins", "starved", "starved"));
  EXPECT_THAT(found.items[0].message, HasSubstr("with /fault and /top active"));
  ASSERT_EQ(found.items[0].more_witnesses.size(), 1u);
  EXPECT_THAT(found.items[0].more_witnesses[0].active, ElementsAre("/mid"));
  EXPECT_THAT(found.items[0].more_witnesses[0].inactive, ElementsAre("/enable", "/top"));
}

TEST(Findings, OfManyCausesSomeAreToldAndTheirNumberIsSaid) {
  const auto causes = [](int count) {
    std::vector<ExpressionPtr> fine;
    for (int i = 0; i < count; ++i) fine.push_back(inactive("/stop" + std::to_string(i)));
    return found_in(RulesByHand().port("/p", {{"/a", all_of(fine)}})).items.at(0);
  };
  EXPECT_THAT(causes(8).message, HasSubstr("(one of 8 such causes);"));
  EXPECT_EQ(causes(8).more_witnesses.size(), 7u);
  EXPECT_THAT(causes(11).message, HasSubstr("(one of 11 such causes, of which 8 are listed);"));
  EXPECT_EQ(causes(11).more_witnesses.size(), 7u);
  EXPECT_THAT(causes(17).message,
              HasSubstr("(one of more than 16 such causes, of which 8 are listed);"));
}

TEST(Findings, ASourceThatWinsNowhereIsToldOnce) {
  const auto never = [](const std::string& source) { return inactive(source); };
  const auto found = found_in(RulesByHand()
                                  .port("/p", {{"/a", never("/a")}, {"/b", always()}}, true)
                                  .port("/q", {{"/a", never("/a")}, {"/c", never("/c")}})
                                  .other("/x", "/p")
                                  .other("/y", "/p")
                                  .other("/y", "/free"));
  ASSERT_THAT(found.codes(), ElementsAre("never-wins", "never-wins"));
  EXPECT_THAT(found.items[0].message, HasSubstr("/a is connected to /p and /q, and there is no"));
  EXPECT_THAT(found.items[1].message, HasSubstr("/x is connected to /p, and there is no state in "
                                                "which it wins anywhere, partly since no rule"));
  EXPECT_EQ(found.items[0].about.source, "/a");
  EXPECT_THAT(found.items[0].about.ports, ElementsAre("/p", "/q"));
}

// /x has no rule, /a has; neither is told of at /b's.
TEST(Findings, ASourceThatWinsNowhereIsToldWhereItIsConnected) {
  const auto found = found_in(RulesByHand()
                                  .port("/p", {{"/b", always()}, {"/a", inactive("/a")}}, true)
                                  .port("/q", {{"/b", always()}})
                                  .other("/x", "/p")
                                  .other("/a", "/q"));
  ASSERT_THAT(found.codes(), ElementsAre("never-wins", "never-wins"));
  EXPECT_EQ(found.items[0].where, (rules::Location{"model.xml", 3, 5})) << "/a has a rule";
  EXPECT_EQ(found.items[1].where, (rules::Location{"application.xml", 6, 3}));
}

TEST(Findings, AQuestionThatOutgrowsItsBoundIsLeftOpenAndSaysSo) {
  const rules::RuleSet set =
      RulesByHand().port("/p", {{"/a", inactive("/b")}}).port("/q", {{"/a", inactive("/b")}});
  const auto found = found_in(set, 2);
  EXPECT_EQ(found.account.ports, 2u);
  EXPECT_EQ(found.account.open, 2u);
  ASSERT_THAT(found.codes(), ElementsAre("left-open"));
  EXPECT_THAT(found.items[0].message, HasSubstr("nobody wins at /p and /q were looked at: at /p, "
                                                "it takes more steps than there are for it"));
  EXPECT_THAT(found.items[0].about.ports, ElementsAre("/p", "/q"));
  EXPECT_EQ(found_in(set).account.open, 0u);
}

// Inhibition graphs of one port, each source of which also has a condition of its own.
using Graph = std::function<std::vector<int>(int source)>;

rules::RuleSet inhibited(int ports, int sources, const Graph& inhibitors, bool first_wins = true) {
  std::vector<std::pair<std::string, ExpressionPtr>> rules;
  for (int i = 0; i < sources; ++i) {
    std::vector<ExpressionPtr> literals;
    for (const int other : inhibitors(i)) literals.push_back(inactive(numbered(other)));
    rules.emplace_back(numbered(i), all_of(std::move(literals)));
  }
  RulesByHand by_hand;
  for (int port = 0; port < ports; ++port) {
    by_hand.port("/p" + std::to_string(port), rules, first_wins);
  }
  return by_hand;
}

void expect_within_bounds(const Found& found, std::size_t ports) {
  EXPECT_EQ(found.account.ports, ports);
  EXPECT_LE(found.spent, kFindingsSteps + kFindingsSteps / 10);
  EXPECT_LE(found.account.open, ports);
  const auto codes = found.codes();
  EXPECT_EQ(std::count(codes.begin(), codes.end(), "left-open"), found.account.open > 0 ? 1 : 0);
}

constexpr int kMostSources = 256;  // kMaxSourcesPerPort
constexpr int kManyPorts = 16;     // 4096 connections

TEST(FindingsScale, AllInhibitAll) {
  const auto found = found_in(inhibited(
      4, kMostSources,
      [](int i) {
        std::vector<int> others;
        for (int j = 0; j < kMostSources; ++j) {
          if (j != i) others.push_back(j);
        }
        return others;
      },
      false));
  expect_within_bounds(found, 4);
  EXPECT_EQ(found.account.open, 0u);
}

TEST(FindingsScale, ChainsOfPriorities) {
  const auto found = found_in(inhibited(
      kManyPorts, kMostSources,
      [](int i) {
        std::vector<int> others;
        for (int j = i + 1; j < kMostSources; ++j) others.push_back(j);
        return others;
      },
      false));
  expect_within_bounds(found, kManyPorts);
  EXPECT_EQ(found.account.open, 0u);
  EXPECT_THAT(found.items, IsEmpty());
}

// Of each two sources one inhibits the other, in no order at all: whether somebody wins takes all.
TEST(FindingsScale, RandomTournaments) {
  for (unsigned seed = 0; seed < 3; ++seed) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    std::mt19937 random(seed);
    constexpr int kCount = 128;
    std::vector<std::vector<int>> inhibitors(kCount);
    for (int i = 0; i < kCount; ++i) {
      for (int j = 0; j < i; ++j) {
        const bool first = random() % 2 == 0;
        inhibitors[static_cast<std::size_t>(first ? i : j)].push_back(first ? j : i);
      }
    }
    const auto found = found_in(inhibited(
        2, kCount, [&](int i) { return inhibitors[static_cast<std::size_t>(i)]; }, false));
    expect_within_bounds(found, 2);
    EXPECT_EQ(found.account.open, 2u);
  }
}

// Each inhibits the half of them that follows it in a circle.
TEST(FindingsScale, CyclesOfInhibition) {
  constexpr int kCount = 65;
  const auto found = found_in(inhibited(
      2, kCount,
      [](int i) {
        std::vector<int> others;
        for (int j = 1; j <= kCount / 2; ++j) others.push_back((i + j) % kCount);
        return others;
      },
      false));
  expect_within_bounds(found, 2);
}

TEST(FindingsScale, TreesWhoseParentsInhibitAllBelow) {
  const auto found = found_in(inhibited(2, 24, [](int i) {
    std::vector<int> above;
    for (int parent = i; parent > 0;) above.push_back(parent = (parent - 1) / 2);
    return above;
  }));
  expect_within_bounds(found, 2);
  EXPECT_EQ(found.account.open, 0u);
}

TEST(FindingsScale, ParitiesAndEqualitiesFarApart) {
  ExpressionPtr parity = active(numbered(0));
  std::vector<ExpressionPtr> mention, equal;
  for (int i = 1; i < 200; ++i) parity = binary(Operator::kXor, parity, active(numbered(i)));
  for (int i = 0; i < 12; ++i) {
    mention.push_back(active("/x" + std::to_string(i)));
    equal.push_back(
        binary(Operator::kIff, active("/x" + std::to_string(i)), active("/y" + std::to_string(i))));
  }
  const auto found =
      found_in(RulesByHand()
                   .port("/p", {{"/odd", parity}, {"/even", negation(parity)}})
                   .port("/q", {{"/a", all_of({any_of(mention), all_of(equal)})},
                                {"/b", negation(all_of({any_of(mention), all_of(equal)}))}}));
  expect_within_bounds(found, 2);
}

}  // namespace
}  // namespace arbiter::test
