// States without a winner of which a proved statement says that nobody shall win.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "rules/ask/findings.hpp"
#include "rules/prove/compile.hpp"
#include "tests/rules/rules_by_hand.hpp"

namespace arbiter::test {
namespace {

using rules::Diagnostics;
using testing::Contains;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;
using testing::UnorderedElementsAreArray;

// The paper's arm: with object and collision both active nobody wins, on purpose. Nothing drives
// the base while an object is there.
rules::RuleSet robot() {
  return RulesByHand()
      .port("/Arm", {{"/Rest", inactive("/Object")}, {"/Object", inactive("/collision")}})
      .port("/Base", {{"/Nav", inactive("/Object")}});
}

// What is found where all of these statements are proved, or not.
std::vector<rules::Diagnostic> items_beside(const rules::RuleSet& set, const std::string& text,
                                            std::uint64_t* spent = nullptr) {
  Diagnostics diagnostics;
  const auto model = compile(set, diagnostics);
  rules::ProvedStatements proved;
  const rules::TextFile file("safety.txt", text);
  rules::Budget to_judge;
  for (const auto& verdict :
       judge(read_statements(file, diagnostics), model, diagnostics, to_judge)) {
    if (verdict.proved) proved.push_back(verdict.proved);
  }
  Diagnostics found;
  rules::Budget budget;
  find_more(set, model, found, budget, proved);
  if (spent != nullptr) *spent = budget.spent();
  return found.items();
}

// "nobody-wins /Arm", each.
std::vector<std::string> found_beside(const std::string& text) {
  std::vector<std::string> result;
  for (const auto& item : items_beside(robot(), text)) {
    const bool is_arm = item.message.find("/Arm") != std::string::npos;
    result.push_back(item.code + (is_arm ? " /Arm" : " /Base"));
  }
  return result;
}

TEST(StatedFindings, WithoutStatementsAllIsNoted) {
  EXPECT_THAT(found_beside("/Rest or not /Rest"),
              ElementsAre("nobody-wins /Arm", "starved /Arm", "nobody-wins /Base"));
}

// More sources than a port may have.
TEST(StatedFindings, AStatementAboutManySourcesOfSeveralPortsHidesNothing) {
  RulesByHand by_hand;
  for (const std::string port : {"/A", "/B"}) {
    const auto source = [&](int number) { return port + "/" + std::to_string(number); };
    std::vector<std::pair<std::string, ExpressionPtr>> rules;
    for (int i = 0; i < 150; ++i) {
      std::vector<ExpressionPtr> others;
      for (int j = 0; j < 150; ++j) {
        if (j != i) others.push_back(inactive(source(j)));
      }
      rules.emplace_back(source(i), all_of(std::move(others)));
    }
    by_hand.port(port, std::move(rules));
  }
  const auto found = [&](const std::string& statement) {
    std::vector<std::string> result;
    for (const auto& item : items_beside(by_hand, statement)) {
      result.push_back(item.code + ' ' + item.message);
    }
    return result;
  };
  const auto beside_wide = found("winner(/A) = /A/0 and winner(/B) = /B/0 -> /A/0");
  EXPECT_THAT(beside_wide, Contains(HasSubstr("inhibition-circle")).Times(2));
  EXPECT_THAT(beside_wide, UnorderedElementsAreArray(found("/other or not /other")));
}

TEST(StatedFindings, AStateThatIsToBeIdleIsNotNoted) {
  EXPECT_THAT(found_beside("/Object and /collision -> idle(/Arm)"),
              ElementsAre("nobody-wins /Base"));
  EXPECT_THAT(found_beside("/Object and /collision -> idle(/Arm)\n/Object -> idle(/Base)"),
              IsEmpty());
}

TEST(StatedFindings, StatementsTogetherMayLeaveItToNobody) {
  const std::string not_object = "/collision -> winner(/Arm) != /Object\n";
  const std::string not_rest = "/Object -> winner(/Arm) != /Rest\n";
  EXPECT_THAT(found_beside(not_object + not_rest), ElementsAre("nobody-wins /Base"));
  // Rest may still win, as far as this says.
  EXPECT_THAT(found_beside(not_object),
              ElementsAre("nobody-wins /Arm", "starved /Arm", "nobody-wins /Base"));
}

TEST(StatedFindings, OnlyTheStatesThatAreCoveredAreQuiet) {
  EXPECT_THAT(found_beside("/Object and /collision and /Nav -> idle(/Arm)"),
              ElementsAre("nobody-wins /Arm", "starved /Arm", "nobody-wins /Base"));
}

TEST(StatedFindings, AStatementMayTieOnePortToAnother) {
  EXPECT_THAT(
      found_beside("idle(/Arm) and /Object -> idle(/Base)\n/Object -> winner(/Arm) != /Rest"),
      ElementsAre("nobody-wins /Arm", "starved /Arm", "nobody-wins /Base"));
  EXPECT_THAT(found_beside("/collision and idle(/Base) and /Object -> idle(/Arm)"),
              ElementsAre("nobody-wins /Base"));
}

TEST(StatedFindings, WhatIsRefutedQuietsNothing) {
  EXPECT_THAT(found_beside("/collision -> idle(/Arm)"),
              ElementsAre("nobody-wins /Arm", "starved /Arm", "nobody-wins /Base"));
}

// The circle that is told where these statements are proved: "/a /b /c", each kept out by the next.
std::string circle_beside(const std::string& text) {
  const rules::RuleSet set = RulesByHand()
                                 .port("/p", {{"/a", inactive("/b")},
                                              {"/b", all_of({inactive("/a"), inactive("/c")})},
                                              {"/c", inactive("/a")}})
                                 .port("/q", {{"/x", inactive("/y")}, {"/y", inactive("/x")}});
  std::string result;
  for (const auto& item : items_beside(set, text)) {
    if (item.code != "inhibition-circle" || item.about.ports != std::vector<std::string>{"/p"}) {
      continue;
    }
    for (const std::string name : {"/a", "/b", "/c"}) {
      if (item.message.find(name + " is kept out") != std::string::npos) result += name + ' ';
    }
  }
  return result;
}

TEST(StatedFindings, ACircleThatIsToBeIdleIsNone) {
  EXPECT_EQ(circle_beside("/x and /y -> idle(/q)"), "/a /b ");
  EXPECT_EQ(circle_beside("/a and /b -> idle(/p)"), "");
}

// Behind the circle that is to be idle, many ways lead on.
TEST(StatedFindings, WaysToOtherCirclesTakeStepsOfTheBudget) {
  std::vector<std::pair<std::string, ExpressionPtr>> rules{{"/b", inactive("/a")}};
  std::vector<ExpressionPtr> of_a{inactive("/b")};
  std::vector<ExpressionPtr> above{inactive("/stop")};
  for (int i = 0; i < 60; ++i) {
    const std::string name = "/c" + std::to_string(i);
    of_a.push_back(inactive(name));
    rules.emplace_back(name, all_of(above));
    above.push_back(inactive(name));
  }
  rules.emplace_back("/a", all_of(of_a));
  const auto steps_beside = [&](const std::string& statement) {
    std::uint64_t steps = 0;
    const auto set = RulesByHand().port("/p", rules);
    EXPECT_THAT(items_beside(set, statement, &steps), testing::Not(IsEmpty()));
    return steps;
  };
  const auto one_circle = steps_beside("/a and /b and none(/c*) -> idle(/p)");
  EXPECT_GT(one_circle, steps_beside("/x or not /x") + 100'000);
}

TEST(StatedFindings, ACircleIsToldThatSharesAnInhibitionWithOneThatIsToBeIdle) {
  EXPECT_EQ(circle_beside("/a and /b and not /c -> idle(/p)"), "/a /b /c ");
  EXPECT_EQ(circle_beside("/a and /b and (/c or not /c) -> idle(/p)"), "");
}

}  // namespace
}  // namespace arbiter::test
