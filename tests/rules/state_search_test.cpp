// States found one by one, against brute force: where rules are decided in order, or diagrams are
// too large, the findings and `diff` rest on them.
#include "rules/prove/state_search.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <random>

#include "rules/ask/findings.hpp"
#include "rules/ask/model_diff.hpp"
#include "rules/prove/winners.hpp"
#include "tests/rules/ordered_rules.hpp"
#include "tests/support/live_table.hpp"
#include "tests/support/rounds.hpp"

namespace arbiter::test {
namespace {

using rules::CompiledModel;
using rules::Diagnostics;
using rules::StateSearch;
using testing::Contains;

const std::vector<std::string> kFiveSources = {"/a", "/b", "/c", "/d", "/e"};

Rules five_rules(std::mt19937& random) {
  const auto leaf = [](const auto& pick) {
    const auto& source = kFiveSources[pick(kFiveSources.size())];
    return pick(2) == 0 ? active(source) : inactive(source);
  };
  Rules rules;
  for (const auto& source : kFiveSources)
    rules.emplace_back(source, random_condition(random, 2, leaf));
  return rules;
}

CompiledModel in_order(const Rules& rules, Diagnostics& diagnostics) {
  return compile(RulesByHand().port("/p", rules, true), diagnostics, 0);
}

bool agrees(const rules::Witness& witness, const Active& now) {
  const auto is_active = [&](const auto& source) { return now.contains(source); };
  return std::all_of(witness.active.begin(), witness.active.end(), is_active) &&
         std::none_of(witness.inactive.begin(), witness.inactive.end(), is_active);
}

// Whether that one wins in every state of which the witness is true.
bool implies(const rules::Witness& witness, const Rules& rules,
             const std::optional<std::string>& winner) {
  const auto states = subsets(kFiveSources);
  return std::all_of(states.begin(), states.end(), [&](const Active& now) {
    return !agrees(witness, now) || first_that_holds(rules, now) == winner;
  });
}

std::vector<rules::Witness> with_one_less(const rules::Witness& witness) {
  std::vector<rules::Witness> result;
  for (const auto side : {&rules::Witness::active, &rules::Witness::inactive}) {
    for (std::size_t i = 0; i < (witness.*side).size(); ++i) {
      result.push_back(witness);
      (result.back().*side).erase((result.back().*side).begin() + static_cast<std::ptrdiff_t>(i));
    }
  }
  return result;
}

TEST(StateSearch, FindsWhoCanWinAndStatesOfWhichNothingCanBeLeftOut) {
  std::mt19937 random(20261122);
  for (int round = 0; round < rounds(200); ++round) {
    SCOPED_TRACE("round " + std::to_string(round));
    const Rules rules = five_rules(random);
    Diagnostics diagnostics;
    const auto model = in_order(rules, diagnostics);
    const auto& port = model.ports.at(0);
    StateSearch search;
    const auto winners = search.winners(port);
    std::set<std::string> can_win;
    for (const auto& now : subsets(kFiveSources)) {
      if (const auto winner = first_that_holds(rules, now)) can_win.insert(*winner);
    }
    for (std::size_t i = 0; i < port.rules.size(); ++i) {
      const auto& source = port.rules[i].source;
      const auto answer = search.find({winners.wins[i]});
      ASSERT_EQ(answer,
                can_win.contains(source) ? StateSearch::Answer::kYes : StateSearch::Answer::kNo);
      if (answer != StateSearch::Answer::kYes) continue;
      const auto witness = search.witness(winners.wins[i]);
      EXPECT_FALSE(witness.is_shortest);
      EXPECT_TRUE(implies(witness, rules, source));
      for (const auto& less : with_one_less(witness)) EXPECT_FALSE(implies(less, rules, source));
    }
  }
}

TEST(StateSearch, WhatIsRequiredIsNoPartOfAWitness) {
  StateSearch search;
  const auto a = search.active("/a"), b = search.active("/b");
  const auto both = search.all_of({a, b});
  search.require_any({a});
  ASSERT_EQ(search.find({both}), StateSearch::Answer::kYes);
  EXPECT_EQ(search.witness(both).active, (std::vector<std::string>{"/a", "/b"}));
  EXPECT_EQ(search.find({-a}), StateSearch::Answer::kNo);
}

TEST(StateSearch, EndsWithItsSteps) {
  StateSearch search(2);
  const auto a = search.active("/a");
  EXPECT_EQ(search.find({a}), StateSearch::Answer::kYes);
  static_cast<void>(search.find({-a}));
  EXPECT_EQ(search.find({a}), StateSearch::Answer::kOpen);
  EXPECT_EQ(search.steps_left(), 0);
}

std::set<std::string> never_selected(const Diagnostics& diagnostics) {
  std::set<std::string> result;
  for (const auto& item : diagnostics.items()) {
    if (item.code == "never-selected")
      result.insert(item.message.substr(0, item.message.find(' ')));
  }
  return result;
}

TEST(InOrder, WarnsOfTheSameRulesThatCanNeverWin) {
  std::mt19937 random(3);
  std::size_t warned = 0;
  for (int round = 0; round < rounds(200); ++round) {
    SCOPED_TRACE("round " + std::to_string(round));
    const Rules rules = five_rules(random);
    std::set<std::string> expected(kFiveSources.begin(), kFiveSources.end());
    for (const auto& now : subsets(kFiveSources)) {
      if (const auto winner = first_that_holds(rules, now)) expected.erase(*winner);
    }
    Diagnostics diagnostics;
    const auto model = in_order(rules, diagnostics);
    EXPECT_EQ(never_selected(diagnostics), expected);
    warned += expected.size();
    LiveTable live(model);
    for (const auto& now : subsets(kFiveSources)) {
      live.activate_only(now);
      ASSERT_EQ(live.winner("/p"), first_that_holds(rules, now));
    }
  }
  EXPECT_GT(warned, rounds(50u));
}

CompiledModel compiled(const Rules& rules) {
  Diagnostics diagnostics;
  auto model = compile(RulesByHand().port("/p", rules, true), diagnostics);
  EXPECT_FALSE(diagnostics.has_errors());
  EXPECT_TRUE(model.ports.at(0).in_order);
  return model;
}

rules::ModelDiff compared_with(const CompiledModel& before, const CompiledModel& after) {
  rules::Budget budget;
  return diff(before, after, budget);
}

TEST(InOrder, ModelsOfManyConnectionsThatDecideAlikeAreProvedTo) {
  const Rules rules = random_inhibitions(256, 1);
  Rules doubled = rules;  // the same conditions in other words
  for (auto& rule : doubled) rule.second = all_of({rule.second, rule.second});
  Rules without = rules;  // one that never holds
  without[9].second = negation(always());
  const auto compared = compared_with(compiled(rules), compiled(doubled));
  EXPECT_FALSE(compared.differs());
  EXPECT_FALSE(compared.is_open());
  EXPECT_TRUE(compared_with(compiled(rules), compiled(without)).differs());
}

TEST(InOrder, WhereModelsOfManyConnectionsDecideDifferentlyIsFound) {
  for (const std::size_t count : {50u, 100u, 256u}) {
    SCOPED_TRACE(std::to_string(count));
    const Rules before = random_inhibitions(count, 1);
    Rules after = before;
    after[count / 2].second =
        all_of({after[count / 2].second, inactive(numbered_source(count / 3))});
    const auto compared = compared_with(compiled(before), compiled(after));
    ASSERT_EQ(compared.ports.size(), 1u);
    const auto& port = compared.ports[0];
    EXPECT_TRUE(port.differs());
    EXPECT_EQ(port.open, "");
    EXPECT_FALSE(port.is_counted);
    ASSERT_FALSE(port.changes.empty());
    for (const auto& change : port.changes) {
      EXPECT_NE(change.before, change.after);
      ASSERT_TRUE(change.example);
      const Active now(change.example->active.begin(), change.example->active.end());
      EXPECT_EQ(first_that_holds(before, now), change.before);
      EXPECT_EQ(first_that_holds(after, now), change.after);
      EXPECT_EQ(change.states, "");
    }
    EXPECT_EQ(port.changes.front().before, numbered_source(count / 2));
  }
}

TEST(InOrder, WhetherNobodyWinsIsAskedOfTheRulesAsTheyStand) {
  Rules rules;
  for (const auto& source : kFiveSources) rules.emplace_back(source, inactive("/x"));
  const rules::RuleSet set = RulesByHand().port("/p", rules, true);
  Diagnostics diagnostics, more;
  const auto model = compile(set, diagnostics, 0);
  ASSERT_TRUE(model.ports.at(0).in_order);
  rules::Budget budget;
  find_more(set, model, more, budget);
  std::vector<std::string> codes;
  for (const auto& item : more.items()) codes.push_back(item.code);
  EXPECT_THAT(codes, Contains("nobody-wins"));
  EXPECT_THAT(codes, Contains("left-open"));
}

}  // namespace
}  // namespace arbiter::test
