// One budget for a whole run, spent fairly, whatever the machine.
#include "rules/prove/budget.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <memory>

#include "rules/ask/findings.hpp"
#include "rules/ask/model_diff.hpp"
#include "rules/ask/verdict.hpp"
#include "rules/prove/compile.hpp"
#include "tests/rules/rules_by_hand.hpp"

namespace arbiter::test {
namespace {

using rules::Budget;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;

// Questions that take so many steps each. What was spent on a question in vain is spent.
struct Questions {
  std::vector<std::uint64_t> take;
  std::vector<std::size_t> answered{};

  std::vector<std::size_t> ask(Budget& budget) {
    return share_out(
        budget, "asking", take.size(), [](std::size_t i) { return std::to_string(i); },
        [&](std::size_t i) {
          for (std::uint64_t step = 0; step < take[i]; ++step) budget.spend(1);
          answered.push_back(i);
        });
  }
};

TEST(Budget, AHardQuestionTakesNothingFromTheEasyOnes) {
  Budget budget(1000);
  Questions questions{{1'000'000, 90, 90, 90, 90}};
  EXPECT_THAT(questions.ask(budget), ElementsAre(0));
  EXPECT_THAT(questions.answered, ElementsAre(1, 2, 3, 4));
  EXPECT_LE(budget.spent(), 1000u + 5u);
}

TEST(Budget, WhatTheEasyOnesLeaveGoesToTheHardOnesWhereverTheyStand) {
  for (std::size_t hard = 0; hard < 10; ++hard) {
    Budget budget(1000);
    Questions questions{std::vector<std::uint64_t>(10, 2)};
    questions.take[hard] = 450;
    EXPECT_THAT(questions.ask(budget), IsEmpty()) << hard;
  }
}

TEST(Budget, OfSeveralHardOnesThoseAreAnsweredThatCanBe) {
  Budget budget(10'000);
  Questions questions{{1'000'000, 1, 2000, 1, 1'000'000, 1}};
  EXPECT_THAT(questions.ask(budget), ElementsAre(0, 4));
  EXPECT_THAT(questions.answered, ElementsAre(1, 2, 3, 5));
}

TEST(Budget, WithoutAnyStepsAllStaysOpenAtOnce) {
  Budget budget(0);
  Questions questions{{1, 1, 1}};
  EXPECT_THAT(questions.ask(budget), ElementsAre(0, 1, 2));
}

TEST(Budget, IsTheSameAfterAPartOfItAndAfterAnOverdraft) {
  Budget budget(100);
  {
    const Budget::Part part(budget, 10);
    EXPECT_EQ(budget.left(), 10u);
    {
      const Budget::Overdraft overdraft(budget);
      budget.spend(30);
    }
    EXPECT_EQ(budget.left(), 0u);
    EXPECT_THROW(budget.spend(1), rules::StepLimit);
  }
  EXPECT_EQ(budget.left(), 69u);
}

TEST(Budget, TellsHowFarItIs) {
  Budget budget(3000);
  std::vector<std::string> told;
  budget.watch([&](const rules::Progress& progress) {
    told.push_back(progress.stage + ' ' + progress.name + ' ' + std::to_string(progress.done) +
                   '/' + std::to_string(progress.of));
  });
  Questions questions{{1400, 10, 10}};
  questions.ask(budget);
  EXPECT_THAT(told, ElementsAre("asking 0 0/3", "asking 1 0/3", "asking 2 1/3", "asking 0 2/3"));
}

TEST(Budget, ARunThatIsAskedToStopHasNoResult) {
  std::stop_source stop;
  Budget budget(Budget::kSteps, stop.get_token());
  budget.watch([&](const rules::Progress&) { stop.request_stop(); });
  Questions questions{{1'000'000, 1'000'000}};
  EXPECT_THROW(questions.ask(budget), rules::Stopped);
  EXPECT_THAT(questions.answered, IsEmpty());
  EXPECT_LT(budget.spent(), 100'000u);
}

std::string name(int i) { return "/s" + std::to_string(i); }

// The last bit but one of a product: no order of the bits makes its diagram small.
ExpressionPtr product_bit(int bits) {
  ExpressionPtr carry = inactive(name(0));
  for (int i = 0; i < bits; ++i) {
    ExpressionPtr sum = active(name(0));
    for (int j = 0; j <= i; ++j) {
      sum = binary(Operator::kXor, sum,
                   all_of({active(name(j)), active(name(bits + (i - j) * 7 % bits))}));
    }
    carry = binary(i % 2 == 0 ? Operator::kXor : Operator::kImplies, carry, sum);
  }
  return carry;
}

rules::RuleSet one_hard_port_of_four() {
  RulesByHand by_hand;
  for (const auto* port : {"/a", "/b", "/d"}) {
    by_hand.port(port, {{"/x", inactive("/y")}, {"/y", inactive("/z")}});
  }
  by_hand.port("/c", {{"/x", product_bit(24)}});
  return by_hand;
}

TEST(Budget, ThePortsOfAModelThatAreProvedDoNotDependOnTheHardOne) {
  rules::Diagnostics diagnostics;
  Budget budget(200'000);
  const auto model = compile(one_hard_port_of_four(), diagnostics, budget);
  std::vector<std::string> proved;
  for (const auto& port : model.ports) proved.push_back(port.port);
  EXPECT_THAT(proved, ElementsAre("/a", "/b", "/d"));
  ASSERT_EQ(diagnostics.items().size(), 1u);
  EXPECT_EQ(diagnostics.items()[0].code, "limit-exceeded");
  EXPECT_THAT(diagnostics.items()[0].message,
              HasSubstr("at /c was neither proved nor refuted: it takes more steps"));
}

TEST(Budget, AModelIsAcceptedWhateverElseIsAskedOfIt) {
  rules::Diagnostics diagnostics;
  Budget budget(200'000);
  compile(one_hard_port_of_four(), diagnostics, budget);
  EXPECT_GE(budget.left(), 200'000u / 5 - 20'000u);
}

// One pigeon more than there are holes, and none shares its hole.
ExpressionPtr too_many_pigeons(int holes) {
  const auto sits = [&](int pigeon, int hole) { return name(pigeon * holes + hole); };
  std::vector<ExpressionPtr> demands;
  for (int pigeon = 0; pigeon <= holes; ++pigeon) {
    std::vector<ExpressionPtr> somewhere;
    for (int hole = 0; hole < holes; ++hole) {
      somewhere.push_back(active(sits(pigeon, hole)));
      for (int other = 0; other < pigeon; ++other) {
        demands.push_back(any_of({inactive(sits(pigeon, hole)), inactive(sits(other, hole))}));
      }
    }
    demands.push_back(any_of(std::move(somewhere)));
  }
  return all_of(std::move(demands));
}

TEST(Budget, WhatExplainsWhyABehaviourNeverRunsLeavesTheStepsToWhatIsAskedLater) {
  RulesByHand by_hand;
  for (int i = 0; i < 3; ++i) {
    const std::string port = "/p" + std::to_string(i);
    by_hand.port(port, {{"/x", too_many_pigeons(7)}});
    by_hand.behaviour("Dead " + std::to_string(i), port, "/x", too_many_pigeons(7));
  }
  rules::Diagnostics diagnostics;
  Budget budget(10'000'000);
  compile(by_hand, diagnostics, budget);
  EXPECT_FALSE(diagnostics.has_errors());
  EXPECT_GE(budget.left(), 8'000'000u);
}

// Ten thousand statements about one port of 256 connections, in which all rules take part.
TEST(Budget, StatementsAboutAPortShareItsDiagrams) {
  std::vector<std::pair<std::string, ExpressionPtr>> connections;
  for (int i = 0; i < 256; ++i) connections.emplace_back(name(i), always());
  rules::Diagnostics diagnostics;
  const auto model = compile(RulesByHand().port("/p", connections, true), diagnostics);
  std::string text;
  for (int i = 0; i < 10'000; ++i) {
    text += name(i % 256) + " and " + name(i / 256) + " -> not idle(/p)\n";
  }
  const rules::TextFile file("safety.txt", text);
  const auto statements = read_statements(file, diagnostics);
  Budget budget;
  const auto verdicts = judge(statements, model, diagnostics, budget);
  ASSERT_EQ(verdicts.size(), 10'000u);
  for (const auto& verdict : verdicts) {
    ASSERT_EQ(verdict.kind, rules::Verdict::Kind::kProved) << verdict.statement;
  }
}

TEST(Budget, AStatementOfAHundredThousandQuantifiersTakesFewSteps) {
  std::vector<std::pair<std::string, ExpressionPtr>> connections;
  for (int i = 0; i < 256; ++i) connections.emplace_back(name(i), always());
  rules::Diagnostics diagnostics;
  const auto model = compile(RulesByHand().port("/p", connections, true), diagnostics);
  std::string text = "any(*)";
  for (int i = 1; i < 100'000; ++i) text += " and any(*)";
  const rules::TextFile file("safety.txt", text + " -> not idle(/p)\n");
  const auto statements = read_statements(file, diagnostics);
  Budget budget(1'000'000);
  const auto verdicts = judge(statements, model, diagnostics, budget);
  ASSERT_EQ(verdicts.size(), 1u);
  EXPECT_EQ(verdicts[0].kind, rules::Verdict::Kind::kProved);
}

TEST(Budget, OfTwoModelsTheEasyPortsAreComparedBesideAHardOne) {
  const auto model = [](const char* stronger, const char* weaker, int bits) {
    RulesByHand by_hand;
    for (const auto* port : {"/a", "/b", "/d"}) {
      by_hand.port(port, {{stronger, always()}, {weaker, inactive(stronger)}});
    }
    by_hand.port("/c", {{"/x", product_bit(bits)}});
    rules::Diagnostics diagnostics;
    auto compiled = compile(by_hand, diagnostics);
    EXPECT_FALSE(diagnostics.has_errors());
    return compiled;
  };
  Budget budget(20'000);
  const auto found = diff(model("/x", "/y", 9), model("/y", "/x", 8), budget);
  ASSERT_EQ(found.ports.size(), 4u);
  for (const auto& port : found.ports) {
    EXPECT_EQ(port.open.empty(), port.port != "/c") << port.port;
    EXPECT_EQ(port.changes.empty(), port.port == "/c") << port.port;
  }
}

}  // namespace
}  // namespace arbiter::test
