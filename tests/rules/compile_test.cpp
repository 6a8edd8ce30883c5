#include "rules/prove/compile.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <random>

#include "rules/prove/flatten.hpp"
#include "tests/rules/ordered_rules.hpp"
#include "tests/support/live_table.hpp"

namespace arbiter::test {
namespace {

using rules::Diagnostics;
using rules::Severity;
using testing::ElementsAre;
using testing::HasSubstr;

// s0 is inhibited by s1 and all after it, and so on: the priorities of the paper.
std::vector<std::pair<std::string, ExpressionPtr>> priority_chain(std::size_t count) {
  std::vector<std::pair<std::string, ExpressionPtr>> rules;
  for (std::size_t i = 0; i < count; ++i) {
    std::vector<ExpressionPtr> literals;
    for (std::size_t j = i + 1; j < count; ++j) literals.push_back(inactive(numbered_source(j)));
    rules.emplace_back(numbered_source(i), all_of(std::move(literals)));
  }
  return rules;
}

std::vector<std::string> codes(const Diagnostics& diagnostics) {
  std::vector<std::string> result;
  for (const auto& item : diagnostics.items()) result.push_back(item.code);
  return result;
}

TEST(Compile, ASourceWithoutConditionAlwaysWins) {
  Diagnostics diagnostics;
  const auto model = compile(RulesByHand().port("/p", {{"/a", always()}}), diagnostics);
  EXPECT_TRUE(diagnostics.items().empty());
  EXPECT_EQ(model.ports.at(0).rules.at(0).kind, shm::table::kAlways);
}

TEST(Compile, AConjunctionListsTheActivityThatEachSourceMustHave) {
  Diagnostics diagnostics;
  const auto model = compile(
      RulesByHand().port("/p", {{"/a", all_of({inactive("/b"), active("/c")})}}), diagnostics);
  const auto& rule = model.ports.at(0).rules.at(0);
  EXPECT_EQ(rule.kind, shm::table::kConjunction);
  EXPECT_THAT(rule.reads, ElementsAre("/b", "/c"));
  EXPECT_THAT(rule.expected, ElementsAre(false, true));
}

TEST(Compile, APortReadsWhatIsWrittenInItsRulesEvenWhereItCannotMatter) {
  Diagnostics diagnostics;
  const auto redundant = any_of({active("/c"), inactive("/c")});
  const auto model =
      compile(RulesByHand().port("/p", {{"/b", all_of({redundant, inactive("/a")})}}), diagnostics);
  EXPECT_THAT(model.ports.at(0).reads, ElementsAre("/a", "/c"));
  EXPECT_THAT(model.ports.at(0).rules.at(0).reads, ElementsAre("/a"));
}

TEST(Compile, APortDoesNotReadASourceThatIsOnlyConnected) {
  Diagnostics diagnostics;
  const auto model =
      compile(RulesByHand().port("/p", {{"/a", inactive("/b")}, {"/b", always()}}), diagnostics);
  EXPECT_THAT(model.ports.at(0).reads, ElementsAre("/b"));
}

TEST(Compile, WithConflictFirstALaterRuleReadsTheEarlierSources) {
  Diagnostics diagnostics;
  const auto model =
      compile(RulesByHand().port("/p", {{"/a", always()}, {"/b", always()}}, true), diagnostics);
  EXPECT_TRUE(diagnostics.items().empty());
  EXPECT_THAT(model.ports.at(0).reads, ElementsAre("/a"));
  EXPECT_THAT(model.ports.at(0).rules.at(1).reads, ElementsAre("/a"));
  EXPECT_THAT(model.ports.at(0).rules.at(1).expected, ElementsAre(false));
}

TEST(Compile, AConnectionWithoutARuleNeverDeliversAtAnArbitratedPort) {
  Diagnostics diagnostics;
  const auto model =
      compile(RulesByHand().port("/p", {{"/a", always()}}).other("/x", "/p"), diagnostics);
  ASSERT_EQ(model.ports.size(), 1u);
  EXPECT_EQ(model.ports[0].rules.at(1).source, "/x");
  EXPECT_EQ(model.ports[0].rules.at(1).kind, shm::table::kNever);
  EXPECT_THAT(model.sources, ElementsAre("/a", "/x"));
}

TEST(Compile, APortThatNoRuleMentionsDeliversEverything) {
  Diagnostics diagnostics;
  const auto model =
      compile(RulesByHand().port("/q", {{"/a", always()}}).other("/x", "/p").other("/a", "/p"),
              diagnostics);
  ASSERT_EQ(model.ports.size(), 2u);
  EXPECT_EQ(model.ports[0].port, "/p");
  EXPECT_FALSE(model.ports[0].arbitrated);
  EXPECT_EQ(model.ports[0].rules.at(0).kind, shm::table::kAlways);
  EXPECT_EQ(model.ports[0].rules.at(1).kind, shm::table::kAlways);
  EXPECT_TRUE(model.ports[1].arbitrated);
}

TEST(Compile, AnEmptyModelIsAModelWithoutPorts) {
  Diagnostics diagnostics;
  const auto model = compile(rules::RuleSet{}, diagnostics);
  EXPECT_TRUE(diagnostics.items().empty());
  EXPECT_TRUE(model.ports.empty());
  EXPECT_EQ(model.timeout, shm::kDefaultTimeout);
}

TEST(Compile, WarnsOfARuleThatNothingSatisfies) {
  Diagnostics diagnostics;
  compile(RulesByHand().port("/p", {{"/a", all_of({active("/b"), inactive("/b")})}}), diagnostics);
  ASSERT_THAT(codes(diagnostics), ElementsAre("never-selected"));
  EXPECT_EQ(diagnostics.items()[0].severity, Severity::kWarning);
  EXPECT_EQ(diagnostics.items()[0].where.line, 2u);
  EXPECT_FALSE(diagnostics.has_errors());
}

TEST(Compile, WarnsOfARuleThatWantsItsOwnSourceInactive) {
  Diagnostics diagnostics;
  compile(RulesByHand().port("/p", {{"/a", inactive("/a")}}), diagnostics);
  EXPECT_THAT(codes(diagnostics), ElementsAre("never-selected"));
}

TEST(Compile, WarnsOfARuleThatAnEarlierOneAlwaysBeats) {
  Diagnostics diagnostics;
  compile(RulesByHand().port("/p", {{"/a", always()}, {"/b", active("/a")}}, true), diagnostics);
  ASSERT_THAT(codes(diagnostics), ElementsAre("never-selected"));
  EXPECT_THAT(diagnostics.items()[0].message, HasSubstr("conflict=\"first\""));
}

TEST(Compile, WarnsOfABehaviourThatNoActivityLetsRun) {
  Diagnostics diagnostics;
  const auto impossible = all_of({active("/b"), inactive("/b")});
  compile(RulesByHand()
              .port("/p", {{"/a", any_of({impossible, inactive("/c")})}})
              .behaviour("Dead", "/p", "/a", impossible)
              .behaviour("Alive", "/p", "/a", inactive("/c")),
          diagnostics);
  ASSERT_THAT(codes(diagnostics), ElementsAre("never-runs"));
  EXPECT_THAT(diagnostics.items()[0].message, HasSubstr("\"Dead\""));
}

TEST(Compile, SaysWhichDemandsKeepABehaviourFromRunning) {
  Diagnostics diagnostics;
  const auto impossible =
      all_of({active("/x"), inactive("/c"), any_of({active("/c"), inactive("/a")})});
  compile(RulesByHand()
              .port("/p", {{"/a", any_of({impossible, active("/y")})}})
              .behaviour("Dead", "/p", "/a", impossible),
          diagnostics);
  ASSERT_THAT(codes(diagnostics), ElementsAre("never-runs"));
  EXPECT_THAT(diagnostics.items()[0].message,
              HasSubstr("its connection from /a to /p asks for /a and ¬/c and (/c ∨ ¬/a), which is "
                        "never so; "));
}

TEST(Compile, SaysThatEarlierConnectionsKeepABehaviourFromRunning) {
  Diagnostics diagnostics;
  compile(RulesByHand()
              .port("/p", {{"/b", always()}, {"/a", active("/b")}}, true)
              .behaviour("Dead", "/p", "/a", active("/b")),
          diagnostics);
  ASSERT_THAT(codes(diagnostics), ElementsAre("never-selected", "never-runs"));
  EXPECT_THAT(diagnostics.items()[1].message, HasSubstr("an earlier one wins there"));
}

TEST(Compile, AMetaBehaviourIsReachedThroughAnyOfItsChildren) {
  rules::RuleSet set = RulesByHand()
                           .port("/p", {{"/a", always()}})
                           .port("/q", {{"/b", inactive("/b")}})
                           .behaviour("Alive", "/p", "/a", always())
                           .behaviour("Dead", "/q", "/b", inactive("/b"));
  const auto meta = [&](const std::string& name, std::vector<std::string> children) {
    set.meta_behaviours.push_back({name, {"model.xml", 1, 1}, std::move(children)});
  };
  meta("Top", {"Half", "Alone"});
  meta("Half", {"Alive", "Dead"});
  meta("Alone", {"Dead"});
  meta("Fine", {"Half"});
  Diagnostics diagnostics;
  compile(set, diagnostics);
  ASSERT_THAT(codes(diagnostics),
              ElementsAre("never-selected", "never-runs", "unreachable-children",
                          "unreachable-children", "unreachable-children"));
  EXPECT_THAT(diagnostics.items()[2].message,
              HasSubstr("1 of the 2 children of \"Top\" can never run: \"Alone\""));
  EXPECT_THAT(diagnostics.items()[3].message,
              HasSubstr("of the 2 children of \"Half\" can never run: \"Dead\""));
  EXPECT_THAT(diagnostics.items()[4].message,
              HasSubstr("1 of the 1 child of \"Alone\" can never run: \"Dead\""));
}

TEST(Compile, ABehaviourThatRunsAtOnePortRuns) {
  Diagnostics diagnostics;
  const auto impossible = inactive("/a");
  rules::RuleSet set = RulesByHand()
                           .port("/p", {{"/a", impossible}})
                           .port("/q", {{"/a", always()}})
                           .behaviour("Half", "/p", "/a", impossible);
  set.behaviours[0].rules.push_back({"/q", {"/a", always(), {}, "Half"}});
  compile(set, diagnostics);
  EXPECT_THAT(codes(diagnostics), ElementsAre("never-selected"));
}

TEST(Compile, AWholePortOfPrioritiesIsProvedAndCompiled) {
  Diagnostics diagnostics;
  const auto model = compile(RulesByHand().port("/p", priority_chain(256)), diagnostics);
  EXPECT_TRUE(diagnostics.items().empty());
  LiveTable table(model);
  table.activate_only({numbered_source(3), numbered_source(200), numbered_source(77)});
  EXPECT_THAT(table.winners("/p"), ElementsAre(numbered_source(200)));
}

TEST(Compile, SixteenPortsOfTwoHundredAndFiftySixConnectionsAreWithinTheLimits) {
  RulesByHand by_hand;
  for (int i = 0; i < 16; ++i) by_hand.port("/p" + std::to_string(i), priority_chain(256));
  Diagnostics diagnostics;
  const auto model = compile(by_hand, diagnostics);
  EXPECT_TRUE(diagnostics.items().empty());
  EXPECT_EQ(model.ports.size(), 16u);
}

TEST(Compile, ParityOfAllTheSourcesThatAPortMayHaveIsASmallDiagram) {
  ExpressionPtr parity = active(numbered_source(0));
  for (std::size_t i = 1; i < 255; ++i) {
    parity = binary(Operator::kXor, parity, active(numbered_source(i)));
  }
  Diagnostics diagnostics;
  const auto model = compile(RulesByHand().port("/p", {{"/own", parity}}), diagnostics);
  EXPECT_TRUE(diagnostics.items().empty());
  EXPECT_EQ(model.ports.at(0).rules.at(0).nodes.size(), 2 * 255u - 1);
  LiveTable table(model);
  table.activate_only({"/own", numbered_source(7), numbered_source(8), numbered_source(200)});
  EXPECT_TRUE(table.winner("/p").has_value());
  table.activate_only({"/own", numbered_source(7), numbered_source(8)});
  EXPECT_FALSE(table.winner("/p").has_value());
}

// x0 = y0 and x1 = y1 and … with all x before all y: 2^n nodes in the order of the document, 3 n in
// a good one.
TEST(Compile, ABadOrderOfTheDocumentIsMendedBySifting) {
  constexpr std::size_t kPairs = 14;
  std::vector<ExpressionPtr> mention, equal;
  for (std::size_t i = 0; i < kPairs; ++i) mention.push_back(active("/x" + numbered_source(i)));
  for (std::size_t i = 0; i < kPairs; ++i) {
    equal.push_back(binary(Operator::kIff, active("/x" + numbered_source(i)),
                           active("/y" + numbered_source(i))));
  }
  Diagnostics diagnostics;
  const auto model = compile(
      RulesByHand().port("/p", {{"/own", all_of({any_of(mention), all_of(equal)})}}), diagnostics);
  EXPECT_TRUE(diagnostics.items().empty());
  const auto& rule = model.ports.at(0).rules.at(0);
  EXPECT_LT(rule.nodes.size(), 200u);
  LiveTable table(model);
  table.activate_only({"/own", "/x" + numbered_source(2), "/y" + numbered_source(2)});
  EXPECT_TRUE(table.winner("/p").has_value());
  table.activate_only({"/own", "/x" + numbered_source(2), "/y" + numbered_source(3)});
  EXPECT_FALSE(table.winner("/p").has_value());
}

// The middle bit of a sum of products has no small diagram in any order.
TEST(Compile, ARuleThatExplodesIsAnErrorThatNamesTheLimit) {
  constexpr std::size_t kBits = 16;
  std::vector<ExpressionPtr> column(2 * kBits, rules::make_constant(false));
  for (std::size_t i = 0; i < kBits; ++i) {
    std::vector<ExpressionPtr> carry_free;
    ExpressionPtr carry = rules::make_constant(false);
    for (std::size_t j = 0; j < kBits; ++j) {
      const auto product =
          all_of({active("/x" + numbered_source(i)), active("/y" + numbered_source(j))});
      const auto old = column[i + j];
      column[i + j] = binary(Operator::kXor, binary(Operator::kXor, old, product), carry);
      carry = any_of({all_of({old, product}), all_of({old, carry}), all_of({product, carry})});
    }
    column[i + kBits] = carry;
  }
  Diagnostics diagnostics;
  compile(RulesByHand().port("/p", {{"/own", column[kBits]}}).port("/q", {{"/a", inactive("/a")}}),
          diagnostics);
  ASSERT_THAT(codes(diagnostics), ElementsAre("limit-exceeded", "never-selected"));
  EXPECT_THAT(diagnostics.items()[0].message, HasSubstr("kMaxNodesPerConnection"));
  EXPECT_EQ(diagnostics.items()[0].where.line, 2u);
}

TEST(Compile, MoreSourcesAtAPortThanTheLimitAreAnError) {
  std::vector<ExpressionPtr> literals;
  for (std::size_t i = 0; i < 256; ++i) literals.push_back(inactive(numbered_source(i)));
  Diagnostics diagnostics;
  compile(RulesByHand().port("/p", {{"/own", all_of(literals)}}), diagnostics);
  ASSERT_THAT(codes(diagnostics), ElementsAre("limit-exceeded"));
  EXPECT_THAT(diagnostics.items()[0].message, HasSubstr("kMaxSourcesPerPort (256)"));
}

TEST(Compile, ConnectionsWithoutARuleCountAgainstTheLimit) {
  RulesByHand by_hand;
  by_hand.port("/p", {{"/own", always()}});
  for (std::size_t i = 0; i < 256; ++i) by_hand.other(numbered_source(i), "/p");
  Diagnostics diagnostics;
  compile(by_hand, diagnostics);
  EXPECT_THAT(codes(diagnostics), ElementsAre("limit-exceeded"));
}

TEST(Compile, MoreDestinationsOfOneSourceThanTheLimitAreAnError) {
  RulesByHand by_hand;
  for (std::size_t i = 0; i < 65; ++i) by_hand.port("/p" + std::to_string(i), {{"/a", always()}});
  Diagnostics diagnostics;
  compile(by_hand, diagnostics);
  ASSERT_THAT(codes(diagnostics), ElementsAre("limit-exceeded"));
  EXPECT_THAT(diagnostics.items()[0].message, HasSubstr("kMaxDestinations (64)"));
}

TEST(Compile, ATableThatCouldBeTooLargeIsRefusedBeforeItIsMade) {
  rules::CompiledModel model;
  rules::CompiledPort port{"/p", true, {}, {}};
  rules::CompiledRule rule;
  rule.nodes.resize(shm::kMaxNodesPerConnection);
  for (int i = 0; i < 22; ++i) port.rules.push_back(rule);
  model.ports.push_back(port);
  EXPECT_GT(largest_table(model), shm::kMaxTableWords);
  model.ports[0].rules.resize(20);
  EXPECT_LE(largest_table(model), shm::kMaxTableWords);
}

TEST(Compile, GivesTheSameTableEachTime) {
  const auto once = [] {
    Diagnostics diagnostics;
    const auto xors =
        binary(Operator::kXor, active("/c"), binary(Operator::kXor, active("/d"), inactive("/e")));
    const auto model = compile(RulesByHand()
                                   .port("/p", {{"/a", xors}, {"/b", negation(xors)}})
                                   .port("/q", priority_chain(20)),
                               diagnostics);
    return LiveTable(model);
  };
  const auto first = once(), second = once();
  const auto all = [](const LiveTable& table) {
    std::vector<std::string> lines;
    for (shm::ConnectionIndex c = 0; c < table.view().connection_count(); ++c) {
      const auto rule = table.view().rule(c);
      std::string line = std::to_string(rule.kind);
      for (shm::Word i = 0; i < rule.reads.count; ++i) line += " " + std::to_string(rule.reads[i]);
      for (shm::Word i = 0; i < rule.nodes.count; ++i) line += " " + std::to_string(rule.nodes[i]);
      lines.push_back(line);
    }
    return lines;
  };
  EXPECT_EQ(all(first), all(second));
}

// Of three literals each, that lie anywhere.
std::vector<ExpressionPtr> random_clauses(std::mt19937& random, std::size_t count,
                                          std::size_t sources) {
  std::vector<ExpressionPtr> clauses;
  while (clauses.size() < count) {
    std::vector<ExpressionPtr> literals;
    while (literals.size() < 3) {
      const auto source = numbered_source(random() % sources);
      literals.push_back(random() % 2 == 0 ? active(source) : inactive(source));
    }
    clauses.push_back(any_of(std::move(literals)));
  }
  return clauses;
}

// In the order in which they are written they took three times these steps.
TEST(Compile, JoinsClausesFromTheLastVariableToTheFirst) {
  std::mt19937 random(7);
  RulesByHand set;
  for (int port = 0; port < 10; ++port) {
    set.port("/p" + std::to_string(port), {{"/own", all_of(random_clauses(random, 120, 40))}});
  }
  Diagnostics diagnostics;
  rules::Budget budget(60'000'000);
  compile(set, diagnostics, budget);
  EXPECT_THAT(codes(diagnostics), testing::Each("never-selected"));
}

// All sources alike, says the first operand, and leaves two states of the rest; without it that is
// too large for a diagram.
TEST(Compile, JoinsClausesAsTheyAreWrittenWhereTheyAreTooLargeOtherwise) {
  std::mt19937 random(1);
  std::vector<ExpressionPtr> all, none;
  for (std::size_t i = 0; i < 80; ++i) {
    all.push_back(active(numbered_source(i)));
    none.push_back(inactive(numbered_source(i)));
  }
  std::vector<ExpressionPtr> operands{any_of({all_of(std::move(all)), all_of(std::move(none))})};
  for (auto& clause : random_clauses(random, 80, 80)) operands.push_back(std::move(clause));
  Diagnostics diagnostics;
  compile(RulesByHand().port("/p", {{"/own", all_of(std::move(operands))}}), diagnostics);
  EXPECT_FALSE(diagnostics.has_errors());
}

}  // namespace
}  // namespace arbiter::test
