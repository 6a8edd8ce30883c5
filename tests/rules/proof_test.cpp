// The proof that one connection wins at most, against brute force over all activations.
#include "rules/prove/proof.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <optional>
#include <random>

#include "rules/prove/compile.hpp"
#include "rules/prove/witness.hpp"
#include "tests/rules/model_text.hpp"
#include "tests/rules/rules_by_hand.hpp"
#include "tests/support/live_table.hpp"
#include "tests/support/rounds.hpp"

namespace arbiter::test {
namespace {

using rules::Diagnostic;
using rules::Diagnostics;
using rules::RuleSet;
using rules::Severity;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;

const std::vector<std::string> kSources = {"/a", "/b", "/c", "/d", "/e"};

ExpressionPtr any_condition(std::mt19937& random, int depth) {
  const auto pick = [&](unsigned n) { return static_cast<unsigned>(random() % n); };
  if (depth == 0 || pick(4) == 0) {
    const auto& source = kSources[pick(static_cast<unsigned>(kSources.size()))];
    return pick(2) == 0 ? active(source) : inactive(source);
  }
  const auto operand = [&] { return any_condition(random, depth - 1); };
  switch (pick(6)) {
    case 0:
      return all_of({operand(), operand(), operand()});
    case 1:
      return any_of({operand(), operand()});
    case 2:
      return binary(Operator::kXor, operand(), operand());
    case 3:
      return binary(Operator::kImplies, operand(), operand());
    case 4:
      return binary(Operator::kIff, operand(), operand());
    default:
      return negation(operand());
  }
}

RulesByHand random_port(std::mt19937& random, bool first_wins) {
  std::vector<std::pair<std::string, ExpressionPtr>> rules;
  const std::size_t count = 2 + random() % 3;
  for (std::size_t i = 0; i < count; ++i) {
    ExpressionPtr condition = any_condition(random, 3);
    // Some ports should have no conflict at all.
    for (std::size_t j = 0; j < i; ++j) {
      if (random() % 4 != 0) condition = all_of({condition, inactive(kSources[j])});
    }
    rules.emplace_back(kSources[i], condition);
  }
  return RulesByHand().port("/p", std::move(rules), first_wins);
}

std::set<std::string> to_set(const std::vector<std::string>& names) {
  return {names.begin(), names.end()};
}

// Whether a and b hold under each activation that agrees with the literals.
bool is_implicant(const rules::ConnectionRule& a, const rules::ConnectionRule& b,
                  const std::set<std::string>& must, const std::set<std::string>& must_not) {
  for (const auto& now : subsets(kSources)) {
    const bool agrees = std::includes(now.begin(), now.end(), must.begin(), must.end()) &&
                        std::none_of(must_not.begin(), must_not.end(),
                                     [&](const auto& s) { return now.contains(s); });
    if (agrees && !(holds(a, now) && holds(b, now))) return false;
  }
  return true;
}

// {literals, active literals} of the best implicant, by trying all of them.
std::pair<std::size_t, std::size_t> best_implicant(const rules::ConnectionRule& a,
                                                   const rules::ConnectionRule& b) {
  std::pair<std::size_t, std::size_t> best{99, 99};
  for (const auto& must : subsets(kSources)) {
    for (const auto& must_not : subsets(kSources)) {
      const std::pair size{must.size() + must_not.size(), must.size()};
      const bool contradicts = std::any_of(
          must.begin(), must.end(), [&](const auto& source) { return must_not.contains(source); });
      if (!contradicts && size < best && is_implicant(a, b, must, must_not)) best = size;
    }
  }
  return best;
}

std::vector<const Diagnostic*> conflicts(const Diagnostics& diagnostics) {
  std::vector<const Diagnostic*> result;
  for (const auto& item : diagnostics.items()) {
    if (item.code == "both-can-win") result.push_back(&item);
  }
  return result;
}

TEST(Proof, FindsAConflictExactlyWhereBruteForceDoesWithAShortestWitness) {
  for (unsigned seed = 0; seed < rounds(400u); ++seed) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    std::mt19937 random(seed);
    const RuleSet set = random_port(random, false);
    Diagnostics diagnostics;
    compile(set, diagnostics);
    const auto& rules = set.ports[0].rules;
    std::size_t expected = 0;
    for (std::size_t second = 0; second < rules.size(); ++second) {
      for (std::size_t first = 0; first < second; ++first) {
        const auto both_hold = [&](const auto& now) {
          return holds(rules[first], now) && holds(rules[second], now);
        };
        const auto all = subsets(kSources);
        if (std::none_of(all.begin(), all.end(), both_hold)) continue;
        const auto found = conflicts(diagnostics);
        ASSERT_GT(found.size(), expected);
        const Diagnostic& conflict = *found[expected++];
        EXPECT_EQ(conflict.severity, Severity::kError);
        EXPECT_EQ(conflict.where, rules[second].where);
        EXPECT_THAT(conflict.message, HasSubstr(rules[second].source + " and " +
                                                rules[first].source + " (model.xml:"));
        ASSERT_TRUE(conflict.witness.has_value());
        const auto& witness = *conflict.witness;
        EXPECT_TRUE(std::is_sorted(witness.active.begin(), witness.active.end()));
        EXPECT_TRUE(std::is_sorted(witness.inactive.begin(), witness.inactive.end()));
        EXPECT_TRUE(is_implicant(rules[first], rules[second], to_set(witness.active),
                                 to_set(witness.inactive)));
        const std::pair size{witness.active.size() + witness.inactive.size(),
                             witness.active.size()};
        EXPECT_EQ(size, best_implicant(rules[first], rules[second]));
      }
    }
    EXPECT_EQ(conflicts(diagnostics).size(), expected);
    EXPECT_EQ(diagnostics.has_errors(), expected > 0);
  }
}

TEST(Proof, WithConflictFirstTheFirstRuleThatHoldsWins) {
  for (unsigned seed = 0; seed < rounds(400u); ++seed) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    std::mt19937 random(seed);
    const RuleSet set = random_port(random, true);
    Diagnostics diagnostics;
    const auto model = compile(set, diagnostics);
    EXPECT_FALSE(diagnostics.has_errors());
    LiveTable table(model);
    for (const auto& now : subsets(set.sources)) {
      std::vector<std::string> expected;
      for (const auto& rule : set.ports[0].rules) {
        if (expected.empty() && holds(rule, now)) expected.push_back(rule.source);
      }
      table.activate_only(now);
      EXPECT_EQ(table.winners("/p"), expected);
    }
  }
}

TEST(Proof, SaysWhereAndWhenTwoCanWinAndWhatToDo) {
  Diagnostics diagnostics;
  compile(RulesByHand().port("/p", {{"/b", inactive("/c")}, {"/a", always()}}), diagnostics);
  ASSERT_EQ(diagnostics.items().size(), 1u);
  const auto& conflict = diagnostics.items()[0];
  EXPECT_EQ(conflict.message,
            "/a and /b (model.xml:2:5) can both win at /p when /a and /b are active while /c is "
            "not; give one a condition that excludes the other, or let document order decide with "
            "<arbiter at=\"/p\" conflict=\"first\"/>");
  EXPECT_THAT(conflict.witness->active, ElementsAre("/a", "/b"));
  EXPECT_THAT(conflict.witness->inactive, ElementsAre("/c"));
}

// Only siblings may inhibit each other, and nobody itself.
TEST(Proof, SaysWhichInhibitionWouldHelp) {
  const auto advice_in = [](const std::string& model) {
    const rules::Loaded loaded = rules::load_text("<behaviors>" + model + "</behaviors>");
    Diagnostics diagnostics;
    compile(loaded.rules, diagnostics);
    const auto& items = diagnostics.items();
    const std::string message = items.empty() ? "" : items[0].message;
    const std::size_t at = message.find("; ") + 2;
    return message.substr(at, message.find(" a condition") - at);
  };
  const std::string a = "<behavior name='A'><config at='/p'>/a</config></behavior>";
  const std::string b = "<behavior name='B'><config at='/p'>/b</config></behavior>";
  const auto box = [](const std::string& name, const std::string& child) {
    return "<meta_behavior name='" + name + "'><behavior>" + child + "</behavior></meta_behavior>";
  };
  EXPECT_EQ(advice_in(a + b), "let one inhibit the other, give one");
  EXPECT_EQ(advice_in(a + b +
                      "<meta_behavior name='M'><behavior>A</behavior><behavior>B</behavior>"
                      "</meta_behavior>"),
            "let one inhibit the other, give one");
  EXPECT_EQ(advice_in(a + b + box("M", "B")),
            "let \"A\" inhibit \"M\" or the other way round, give one");
  EXPECT_EQ(advice_in(a + b + box("M", "B") + box("Outer", "M") + box("N", "A")),
            "let \"N\" inhibit \"Outer\" or the other way round, give one");
  EXPECT_EQ(advice_in("<behavior name='A'><config at='/p'>/a</config><config at='/p'>/b</config>"
                      "</behavior>"),
            "give each a behaviour of its own in place of \"A\" and let one inhibit the other, "
            "give one");
  EXPECT_EQ(advice_in(a + "<arbiter at='/p'><select from='/b'/></arbiter>"), "give one");
  // Several behaviours for one connection.
  const std::string more_of_b = "<behavior name='C'><config at='/p'>/b</config></behavior>";
  EXPECT_EQ(advice_in(a + b + more_of_b), "let \"A\" inhibit \"B\" and \"C\", give one");
  EXPECT_EQ(advice_in(a + b + more_of_b +
                      "<meta_behavior name='M'><behavior>B</behavior><behavior>C</behavior>"
                      "</meta_behavior>"),
            "let \"A\" inhibit \"M\", give one");
  const std::string both = "<config at='/p'>/a</config><config at='/p'>/b</config></behavior>";
  // A connection must not lose what makes it win alone.
  EXPECT_EQ(advice_in(b + "<behavior name='Both'>" + both), "give one");
  EXPECT_EQ(advice_in("<behavior name='One'>" + both + "<behavior name='Two'>" + both), "give one");
}

TEST(Proof, WhatIsToBeCopiedIsXml) {
  Diagnostics diagnostics;
  compile(RulesByHand().port("/p&q", {{"/b", always()}, {"/a", always()}}), diagnostics);
  ASSERT_EQ(diagnostics.items().size(), 1u);
  EXPECT_THAT(diagnostics.items()[0].message,
              testing::EndsWith("<arbiter at=\"/p&amp;q\" conflict=\"first\"/>"));
}

// Each path through the diagram begins with a decision on the selector /s, which comes first in it;
// the shortest implicant leaves it out.
TEST(Proof, TheWitnessIsShorterThanTheShortestPathWhereTheOrderMisleads) {
  const auto chosen = any_of({all_of({active("/s"), any_of({active("/x"), active("/y")})}),
                              all_of({inactive("/s"), any_of({active("/x"), active("/z")})})});
  Diagnostics diagnostics;
  compile(RulesByHand().port("/p", {{"/a", chosen}, {"/b", always()}}), diagnostics);
  ASSERT_EQ(diagnostics.items().size(), 1u);
  EXPECT_THAT(diagnostics.items()[0].witness->active, ElementsAre("/a", "/b", "/x"));
  EXPECT_THAT(diagnostics.items()[0].witness->inactive, IsEmpty());
}

TEST(Proof, ReportsEveryPairUpToABoundAndCountsTheRest) {
  std::vector<std::pair<std::string, ExpressionPtr>> rules;
  for (int i = 0; i < 8; ++i) rules.emplace_back("/s" + std::to_string(i), always());
  Diagnostics diagnostics;
  compile(RulesByHand().port("/p", rules), diagnostics);
  EXPECT_EQ(conflicts(diagnostics).size(), 16u);
  const auto& last = diagnostics.items().back();
  EXPECT_EQ(last.code, "more-conflicts");
  EXPECT_EQ(last.severity, Severity::kNote);
  EXPECT_THAT(last.message, HasSubstr("12 more pairs"));
}

TEST(Proof, RulesThatExcludeEachOtherWithoutACommonLiteralAreProvedToo) {
  const auto parity =
      binary(Operator::kXor, active("/x"), binary(Operator::kXor, active("/y"), active("/z")));
  Diagnostics diagnostics;
  compile(RulesByHand().port("/p", {{"/a", parity}, {"/b", negation(parity)}}), diagnostics);
  EXPECT_THAT(diagnostics.items(), IsEmpty());
}

// Each connection inhibited by 3 of the next 12: one diagram of the whole port would explode.
TEST(Proof, InhibitionsThatWouldExplodeAsOneDiagramAreProvedByPairs) {
  std::mt19937 random(7);
  std::vector<std::pair<std::string, ExpressionPtr>> rules;
  constexpr int kCount = 64;
  for (int i = 0; i < kCount; ++i) {
    std::vector<ExpressionPtr> literals;
    for (int j = 0; j < 3; ++j) {
      literals.push_back(
          inactive("/s" + std::to_string((i + 1 + static_cast<int>(random() % 12)) % kCount)));
    }
    rules.emplace_back("/s" + std::to_string(i), all_of(literals));
  }
  Diagnostics diagnostics;
  compile(RulesByHand().port("/p", rules), diagnostics);
  EXPECT_EQ(conflicts(diagnostics).size(), 16u);
  Diagnostics of_first;
  const auto model = compile(RulesByHand().port("/p", rules, true), of_first);
  EXPECT_FALSE(of_first.has_errors());
  EXPECT_EQ(model.ports.size(), 1u);
}

// Sums of bits, of which no order of the variables makes the diagrams small. Those of `b` say of
// one sum the opposite of what those of `a` come to, or leave it open.
struct Sums {
  rules::DiagramNodes a, b;
};
Sums sums_that_exclude_each_other(bool really) {
  constexpr int kVariables = 24, kSums = 4;
  rules::DiagramBuilder builder;
  std::mt19937 random(24);
  rules::Diagram a = builder.constant(true), b = a, total = builder.constant(false);
  const auto add = [&](rules::Diagram& function) {
    rules::Diagram sum = builder.constant(false);
    for (int i = 0; i < kVariables; ++i) {
      if (random() % 2 == 0)
        sum = builder.combine(rules::Connective::kXor, sum, builder.variable(i));
    }
    function = builder.combine(rules::Connective::kAnd, function, sum);
    total = builder.combine(rules::Connective::kXor, total, sum);
  };
  for (int i = 0; i < kSums; ++i) add(a);
  for (int i = 0; i < kSums; ++i) add(b);
  // With these 2 * kSums all true, their sum is false.
  if (really) b = builder.combine(rules::Connective::kAnd, b, total);
  return {builder.nodes(a), builder.nodes(b)};
}

TEST(Proof, ForgetsPairsRatherThanRememberMoreOfThemThanItMay) {
  for (const bool really : {true, false}) {
    const Sums sums = sums_that_exclude_each_other(really);
    rules::Budget of_all, of_few;
    rules::Proof all(of_all), few(of_few, 256);
    const auto meet = all.pairs_that_meet({sums.a, sums.b});
    EXPECT_EQ(meet.empty(), really);
    EXPECT_EQ(few.pairs_that_meet({sums.a, sums.b}), meet);
    if (really)
      EXPECT_GT(of_few.spent(), of_all.spent()) << "what was forgotten is looked at again";
  }
}

TEST(Witness, AShortestImplicantOfEachFunctionOfThreeVariablesIsOneByBruteForce) {
  rules::DiagramBuilder builder;
  for (unsigned truth_table = 1; truth_table < 256; ++truth_table) {
    rules::Diagram function = builder.constant(false);
    for (unsigned row = 0; row < 8; ++row) {
      if ((truth_table >> row & 1) == 0) continue;
      rules::Diagram term = builder.constant(true);
      for (int i = 2; i >= 0; --i) {
        const auto literal =
            (row >> i & 1) != 0 ? builder.variable(i) : builder.negate(builder.variable(i));
        term = builder.combine(rules::Connective::kAnd, term, literal);
      }
      function = builder.combine(rules::Connective::kOr, function, term);
    }
    rules::ShortestImplicant shortest(builder);
    const auto found = shortest.find(function);
    ASSERT_TRUE(found.has_value());
    EXPECT_TRUE(holds_given(builder.nodes(function), *found));
    const auto covers = [&](unsigned active, unsigned inactive) {
      for (unsigned row = 0; row < 8; ++row) {
        if ((row & active) == active && (row & inactive) == 0 && (truth_table >> row & 1) == 0) {
          return false;
        }
      }
      return true;
    };
    std::pair<int, int> best{99, 99};
    for (unsigned active = 0; active < 8; ++active) {
      for (unsigned inactive = 0; inactive < 8; ++inactive) {
        if ((active & inactive) != 0 || !covers(active, inactive)) continue;
        best = std::min(
            best, std::pair(__builtin_popcount(active | inactive), __builtin_popcount(active)));
      }
    }
    EXPECT_EQ(found->count(), static_cast<std::size_t>(best.first)) << "function " << truth_table;
    EXPECT_EQ(found->active.count(), static_cast<std::size_t>(best.second));
  }
}

TEST(Witness, WithoutASearchSomeImplicantIsFoundOfWhichNothingCanBeLeftOut) {
  rules::DiagramBuilder builder;
  const auto pair = [&](int i, int j) {
    return builder.combine(rules::Connective::kXor, builder.variable(i), builder.variable(j));
  };
  const auto a = builder.nodes(builder.combine(rules::Connective::kOr, pair(0, 1), pair(2, 3)));
  const auto b = builder.nodes(builder.combine(rules::Connective::kOr, pair(1, 2), pair(4, 5)));
  rules::Budget none(0);  // that they meet is known, so what it costs to see where is not asked
  const rules::Literals point = rules::Proof(none).meeting_point(a, b);
  EXPECT_TRUE(holds_given(a, point));
  EXPECT_TRUE(holds_given(b, point));
  for (std::size_t i = 0; i < 6; ++i) {
    rules::Literals less = point;
    if (!less.active[i] && !less.inactive[i]) continue;
    less.active.reset(i);
    less.inactive.reset(i);
    EXPECT_FALSE(holds_given(a, less) && holds_given(b, less));
  }
}

}  // namespace
}  // namespace arbiter::test
