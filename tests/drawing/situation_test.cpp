#include "drawing/situation.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/rules/model_text.hpp"
#include "tests/rules/random_model.hpp"
#include "tests/support/live_table.hpp"
#include "tests/support/meaning.hpp"

namespace arbiter::drawing {
namespace {

using rules::load_text;
using testing::Pair;
using testing::UnorderedElementsAre;

const std::string kModel = R"(<behaviors>
  <behavior name="Low"><config at="/p">/low</config><config at="/q">/low</config></behavior>
  <behavior name="High"><config at="/p">/high</config><inhibition>Low</inhibition>
    <condition>not /stop</condition></behavior>
  <behavior name="Also"><config at="/q">/low</config></behavior>
</behaviors>)";

std::vector<State> states(const rules::RuleSet& rules, const std::set<std::string>& active) {
  const Situation situation = decide(rules, active);
  std::vector<State> result;
  for (const auto& behaviour : rules.behaviours) result.push_back(state_of(behaviour, situation));
  return result;
}

TEST(Situation, NamesTheWinnerOfEachPortThatHasOne) {
  const auto loaded = load_text(kModel);
  EXPECT_THAT(decide(loaded.rules, {}).winners, testing::IsEmpty());
  EXPECT_THAT(decide(loaded.rules, {"/low"}).winners,
              UnorderedElementsAre(Pair("/p", "/low"), Pair("/q", "/low")));
  EXPECT_THAT(decide(loaded.rules, {"/high", "/stop"}).winners, testing::IsEmpty());
}

TEST(Situation, ABehaviourRunsIfItWinsSomewhere) {
  const auto loaded = load_text(kModel);
  using enum State;
  EXPECT_EQ(states(loaded.rules, {}), (std::vector{kSilent, kSilent, kSilent}));
  EXPECT_EQ(states(loaded.rules, {"/high"}), (std::vector{kSilent, kRuns, kSilent}));
  EXPECT_EQ(states(loaded.rules, {"/high", "/stop"}), (std::vector{kSilent, kOverridden, kSilent}));
  // /low wins at /q by the rule of Also: High silences Low there as well, having nothing at /q.
  EXPECT_EQ(states(loaded.rules, {"/low", "/high"}), (std::vector{kOverridden, kRuns, kRuns}));
}

TEST(Situation, WhereMoreThanOneMayHoldTheFirstOneWins) {
  const auto loaded = load_text(R"(<behaviors>
    <behavior name="A"><config at="/p">/a</config></behavior>
    <behavior name="B"><config at="/p">/b</config></behavior>
    <arbiter at="/p" conflict="first"/></behaviors>)");
  EXPECT_THAT(decide(loaded.rules, {"/a", "/b"}).winners, UnorderedElementsAre(Pair("/p", "/a")));
}

// Against the definition of a rule, over all activities.
TEST(Situation, NamesTheWinnersOfRandomModels) {
  const test::Vocabulary words;
  for (unsigned seed = 0; seed < 20; ++seed) {
    const test::RandomModel random = test::Generator(seed).model();
    const auto loaded = load_text(test::to_xml(random, {words.ports.begin(), words.ports.end()}));
    ASSERT_FALSE(loaded.has_errors) << loaded.message();
    const test::NaiveEvaluator naive(random);
    for (const auto& active : test::subsets(words.sources)) {
      std::map<std::string, std::string> winners;
      for (const auto& port : words.ports) {
        if (const auto winner = naive.winner(port, active)) winners[port] = *winner;
      }
      EXPECT_EQ(decide(loaded.rules, active).winners, winners) << "seed " << seed;
    }
  }
}

// Against the meaning of conditions by the book, over all activities of four sources.
TEST(Situation, ConditionsMeanWhatTheyMeanElsewhere) {
  for (const char* condition :
       {"true", "false", "/a xor /b", "/a -> /b -> /c", "/a iff not /b or /c and /d",
        "any(/*) and not all(/*)", "none(/a*) implies (/b xor /c)", "not (/a and /b) or /d"}) {
    const auto loaded = load_text(
        "<behaviors><source port='/b'/><source port='/c'/>"
        "<source port='/d'/><arbiter at='/p'><select from='/a'><![CDATA[" +
        std::string(condition) + "]]></select></arbiter></behaviors>");
    ASSERT_FALSE(loaded.has_errors) << loaded.message();
    const rules::ConnectionRule& rule = loaded.rules.ports.at(0).rules.at(0);
    for (unsigned mask = 0; mask < 16; ++mask) {
      std::set<std::string> active;
      for (unsigned i = 0; i < 4; ++i) {
        if ((mask >> i & 1) != 0) active.insert(std::string("/") + static_cast<char>('a' + i));
      }
      EXPECT_EQ(holds(rule, active), active.contains("/a") && test::holds(*rule.condition, active))
          << condition << ' ' << mask;
    }
  }
}

}  // namespace
}  // namespace arbiter::drawing
