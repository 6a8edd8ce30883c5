#include "rules/ask/verdict.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <random>

#include "rules/prove/compile.hpp"
#include "tests/rules/compiled.hpp"
#include "tests/rules/rules_by_hand.hpp"

namespace arbiter::test {
namespace {

using rules::Diagnostics;
using rules::Verdict;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;
using testing::Pair;

// The paper's arm, and a base that navigation drives.
rules::CompiledModel arm_and_base() {
  return compiled(
      RulesByHand()
          .port("/Arm", {{"/Rest", inactive("/Object")}, {"/Object", inactive("/collision")}})
          .port("/Base", {{"/Nav", inactive("/Object")}})
          .other("/Camera", "/View"));
}

struct Judged {
  std::vector<Verdict> verdicts;
  Diagnostics diagnostics;
};

Judged judged(const rules::CompiledModel& model, const std::string& text,
              std::uint64_t steps = rules::Budget::kSteps) {
  Judged result;
  const rules::TextFile file("safety.txt", text);
  const auto statements = read_statements(file, result.diagnostics);
  rules::Budget budget(steps);
  result.verdicts = judge(statements, model, result.diagnostics, budget);
  return result;
}

Verdict::Kind kind_of(const rules::CompiledModel& model, const std::string& text) {
  const auto result = judged(model, text);
  EXPECT_THAT(result.diagnostics.items(), IsEmpty()) << text;
  EXPECT_EQ(result.verdicts.size(), 1u);
  return result.verdicts.at(0).kind;
}

TEST(Verdict, WhatIsTrueInEveryStateIsProved) {
  for (const auto* text :
       {"true", "winner(/Arm) = /Rest -> /Rest", "/collision -> winner(/Arm) != /Object",
        "/Object -> idle(/Base)", "/Object and /collision -> idle(/Arm) and idle(/Base)",
        "winner(/Arm) = /Object -> not winner(/Base) = /Nav", "none(*) -> idle(/Arm)",
        "idle(/Arm) or any(/Rest) or any(/Obj*)", "winner(/Arm) = none <-> idle(/Arm)"}) {
    EXPECT_EQ(kind_of(arm_and_base(), text), Verdict::Kind::kProved) << text;
  }
}

TEST(Verdict, WhatIsNotIsRefutedWithAShortestWitnessAndItsWinners) {
  const auto result = judged(arm_and_base(), "/collision -> idle(/Arm)\n");
  ASSERT_EQ(result.verdicts.size(), 1u);
  const auto& verdict = result.verdicts[0];
  EXPECT_EQ(verdict.kind, Verdict::Kind::kRefuted);
  EXPECT_THAT(verdict.witness->active, ElementsAre("/Rest", "/collision"));
  EXPECT_THAT(verdict.witness->inactive, ElementsAre("/Object"));
  EXPECT_THAT(verdict.winners, ElementsAre(Pair("/Arm", std::optional<std::string>("/Rest"))));
  Diagnostics diagnostics;
  report(result.verdicts, diagnostics);
  ASSERT_EQ(diagnostics.items().size(), 1u);
  EXPECT_EQ(diagnostics.items()[0].code, "refuted");
  const auto& about = diagnostics.items()[0].about;
  EXPECT_THAT(about.ports, ElementsAre("/Arm"));
  EXPECT_EQ(about.statement, "/collision -> idle(/Arm)");
  EXPECT_EQ(about.winners, verdict.winners);
  EXPECT_TRUE(diagnostics.has_errors());
  EXPECT_EQ(diagnostics.items()[0].message,
            "this is false with /Rest and /collision active and /Object inactive, whatever else "
            "is; /Rest wins at /Arm if nothing else is active; change the model so that this "
            "state is decided otherwise, or the statement if it says too much");
}

TEST(Verdict, OneOfSeveralAndTheSameAtTwoPortsAreProvedAndRefuted) {
  const auto model =
      compiled(RulesByHand()
                   .port("/Arm", {{"/Nav/a", inactive("/Nav/b")},
                                  {"/Nav/b", always()},
                                  {"/Rest", all_of({inactive("/Nav/a"), inactive("/Nav/b")})}})
                   .port("/Base", {{"/Nav/a", inactive("/Nav/b")}, {"/Nav/b", inactive("/stop")}}));
  for (const auto* text :
       {"any(/Nav/*) -> winner(/Arm) = any(/Nav/*)", "winner(/Base) != any(/Rest*) or /Rest",
        "winner(/Arm) = winner(/Arm)", "winner(/Arm) != winner(/Base) -> /Rest or /stop",
        "none(*) -> winner(/Arm) = winner(/Base)"}) {
    const auto result = judged(model, text);
    ASSERT_EQ(result.verdicts.size(), 1u) << text;
    EXPECT_EQ(result.verdicts[0].kind, Verdict::Kind::kProved) << text;
  }
  const auto refuted =
      judged(model, "winner(/Arm) = winner(/Base)\n/Rest -> winner(/Arm) != any(/Nav/*)");
  ASSERT_EQ(refuted.verdicts.size(), 2u);
  EXPECT_THAT(refuted.verdicts[0].witness->active, ElementsAre("/Nav/b", "/stop"));
  EXPECT_THAT(refuted.verdicts[0].witness->inactive, IsEmpty());
  EXPECT_THAT(
      refuted.verdicts[0].winners,
      ElementsAre(Pair("/Arm", std::optional<std::string>("/Nav/b")), Pair("/Base", std::nullopt)));
  EXPECT_EQ(refuted.verdicts[1].witness->active.size(), 2u);
}

TEST(Verdict, NamesOfOneOfSeveralAndOfTheSameAreJudged) {
  const auto result = judged(arm_and_base(),
                             "winner(/Arm) = winner(/Leg)\n"
                             "winner(/View) = winner(/Arm)\n"
                             "winner(/Base) = any(/Object*)\n");
  std::vector<std::string> codes;
  for (const auto& item : result.diagnostics.items()) codes.push_back(item.code);
  EXPECT_THAT(codes, ElementsAre("unknown-port", "not-arbitrated", "matches-nothing"));
  EXPECT_EQ(result.diagnostics.items()[0].about.statement, "winner(/Arm) = winner(/Leg)");
  EXPECT_EQ(result.diagnostics.items()[0].about.ports, (std::vector<std::string>{"/Leg"}));
}

TEST(Verdict, WithConflictFirstTheOrderDecidesWhoWins) {
  const auto model = compiled(RulesByHand().port("/p", {{"/a", always()}, {"/b", always()}}, true));
  EXPECT_EQ(kind_of(model, "/a -> winner(/p) = /a"), Verdict::Kind::kProved);
  EXPECT_EQ(kind_of(model, "/b -> winner(/p) = /b"), Verdict::Kind::kRefuted);
}

TEST(Verdict, NamesThatMeanNothingInTheModelAreErrorsWithTheirPlaces) {
  const auto result = judged(arm_and_base(),
                             "/collison -> idle(/Arm)\n"
                             "idle(/Arms)\n"
                             "idle(/View)\n"
                             "winner(/Arm) = /Nav\n"
                             "/Object -> true\n");
  std::vector<std::string> found;
  for (const auto& item : result.diagnostics.items()) {
    found.push_back(std::to_string(item.where.line) + ":" + std::to_string(item.where.column) +
                    " " + item.code);
  }
  EXPECT_THAT(found, ElementsAre("1:1 unknown-source", "2:6 unknown-port", "3:6 not-arbitrated",
                                 "4:16 not-connected"));
  EXPECT_THAT(result.diagnostics.items()[0].message, HasSubstr("\"/collision\""));
  EXPECT_THAT(result.diagnostics.items()[1].message, HasSubstr("\"/Arm\""));
  ASSERT_EQ(result.verdicts.size(), 1u);
  EXPECT_EQ(result.verdicts[0].statement, "/Object -> true");
}

TEST(Verdict, APortOfTheOtherKindIsNamedAsThat) {
  const auto result = judged(arm_and_base(),
                             "idle(/Nav)\n"
                             "active(/Arm)\n");
  ASSERT_EQ(result.diagnostics.items().size(), 2u);
  EXPECT_THAT(result.diagnostics.items()[0].message,
              HasSubstr("; it is an output port: name an input port that is arbitrated, as /Base, "
                        "which it is connected to"));
  EXPECT_THAT(result.diagnostics.items()[1].message,
              HasSubstr("/Arm is an input port, which is never active; name a source, or write "
                        "idle(/Arm) or winner(/Arm) = SOURCE"));
}

TEST(Verdict, APatternThatNothingMatchesIsAWarning) {
  const auto meant = judged(arm_and_base(), "none(/Objetc*) or winner(/Arm) = any(/Objetc*)\n");
  ASSERT_EQ(meant.diagnostics.items().size(), 2u);
  for (const auto& item : meant.diagnostics.items()) {
    EXPECT_THAT(item.message, HasSubstr("did you mean \"/Object*\"?"));
  }
  const auto result = judged(arm_and_base(), "none(/Teleop*)\n");
  ASSERT_EQ(result.diagnostics.items().size(), 1u);
  EXPECT_EQ(result.diagnostics.items()[0].code, "matches-nothing");
  EXPECT_FALSE(result.diagnostics.has_errors());
}

TEST(Verdict, WhatTakesTooManyStepsIsLeftOpenAndAnError) {
  const auto result = judged(arm_and_base(), "/collision -> idle(/Arm)\n", 3);
  ASSERT_EQ(result.verdicts.size(), 1u);
  EXPECT_EQ(result.verdicts[0].kind, Verdict::Kind::kOpen);
  Diagnostics diagnostics;
  report(result.verdicts, diagnostics);
  ASSERT_EQ(diagnostics.items().size(), 1u);
  EXPECT_EQ(diagnostics.items()[0].code, "left-open");
  EXPECT_TRUE(diagnostics.has_errors());
}

// Each connection inhibited by 3 of the next 12: that nobody wins has no small diagram. The winners
// by themselves have, and what is left of these statements then needs no more.
TEST(Verdict, IdlenessThatExplodesAsOneDiagramIsProvedByCases) {
  std::mt19937 random(7);
  std::vector<std::pair<std::string, ExpressionPtr>> rules;
  constexpr int kCount = 64;
  for (int i = 0; i < kCount; ++i) {
    std::vector<ExpressionPtr> literals{inactive("/stop")};
    for (int j = 0; j < 3; ++j) {
      literals.push_back(
          inactive("/s" + std::to_string((i + 1 + static_cast<int>(random() % 12)) % kCount)));
    }
    rules.emplace_back("/s" + std::to_string(i), all_of(literals));
  }
  const auto model = compiled(RulesByHand().port("/p", rules, true));
  EXPECT_EQ(kind_of(model, "/stop -> idle(/p)"), Verdict::Kind::kProved);
  EXPECT_EQ(kind_of(model, "winner(/p) != none -> not /stop"), Verdict::Kind::kProved);
  EXPECT_EQ(kind_of(model, "/s3 -> idle(/p)"), Verdict::Kind::kRefuted);
  std::string others = "/stop";
  for (int i = 0; i + 1 < kCount; ++i) others += " or /s" + std::to_string(i);
  const std::string statement = "idle(/p) and /s63 -> " + others;
  EXPECT_EQ(kind_of(model, statement), Verdict::Kind::kProved);
  // Whichever of the two ways a bound leaves room for, none tells anything but the truth.
  int proved = 0;
  for (std::uint64_t steps = 1'000; steps < 300'000'000; steps *= 8) {
    const auto kind = judged(model, statement, steps).verdicts.at(0).kind;
    EXPECT_NE(kind, Verdict::Kind::kRefuted) << steps;
    proved += kind == Verdict::Kind::kProved ? 1 : 0;
  }
  EXPECT_GT(proved, 0);
}

TEST(Verdict, AStatementMayReadManyPortsOfManySources) {
  RulesByHand by_hand;
  std::string text;
  for (int port = 0; port < 3; ++port) {
    std::vector<std::pair<std::string, ExpressionPtr>> rules;
    for (int i = 0; i < 200; ++i) {
      const auto name = [&](int j) {
        return "/p" + std::to_string(port) + "s" + std::to_string(j);
      };
      std::vector<ExpressionPtr> literals;
      for (int j = i + 1; j < 200; ++j) literals.push_back(inactive(name(j)));
      rules.emplace_back(name(i), all_of(literals));
    }
    const std::string name = "/p" + std::to_string(port);
    by_hand.port(name, std::move(rules));
    text += (port == 0 ? "" : " and ") + ("(any(" + name + "s*) iff not idle(" + name + "))");
  }
  EXPECT_EQ(kind_of(compiled(by_hand), text), Verdict::Kind::kProved);
}

}  // namespace
}  // namespace arbiter::test
