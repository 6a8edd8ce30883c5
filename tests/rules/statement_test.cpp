#include "rules/model/statement.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/rules/model_text.hpp"

namespace arbiter::rules {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;

struct Read {
  std::vector<Statement> statements;
  std::vector<Diagnostic> items;

  [[nodiscard]] std::vector<std::string> findings() const {
    std::vector<std::string> result;
    for (const auto& item : items) {
      result.push_back(std::to_string(item.where.line) + ":" + std::to_string(item.where.column) +
                       " " + item.code);
    }
    return result;
  }
};

Read read(const std::string& text) {
  Diagnostics diagnostics;
  const TextFile file("safety.txt", text);
  auto statements = read_statements(file, diagnostics);
  return {std::move(statements), diagnostics.items()};
}

TEST(Statement, OfAFileMustBeOneAtLeast) {
  for (const std::string text : {"", " \n", "# none\n"}) {
    EXPECT_THAT(read(text).findings(), ElementsAre("1:1 no-statements"));
  }
  EXPECT_THAT(read("/a or\n").findings(), ElementsAre(testing::Not(HasSubstr("no-statements"))));
}

TEST(Statement, StandsOnALineAndCommentsAreLeftOut) {
  const auto found = read(
      "# who has collided\n\n/a -> /b   # does not move\nnot /c\r\n\"/d#e\" or /f # a \"quote\n");
  EXPECT_THAT(found.items, IsEmpty());
  ASSERT_EQ(found.statements.size(), 3u);
  EXPECT_EQ(found.statements[0].text, "/a -> /b");
  EXPECT_EQ(found.statements[0].where, (Location{"safety.txt", 3, 1}));
  EXPECT_EQ(show(found.statements[0].parsed.expression), "(/a implies /b)");
  EXPECT_EQ(show(found.statements[1].parsed.expression), "not(/c)");
  EXPECT_EQ(show(found.statements[2].parsed.expression), "(/d#e or /f)");
}

TEST(Statement, ALineThatBeginsWithABlankGoesOn) {
  const auto found = read("/a ->\n  # why\n  /b and  # both\n\t/c\n/d\n");
  EXPECT_THAT(found.items, IsEmpty());
  ASSERT_EQ(found.statements.size(), 2u);
  EXPECT_EQ(found.statements[0].text, "/a -> /b and /c");
  EXPECT_EQ(show(found.statements[0].parsed.expression), "(/a implies (/b and /c))");
}

TEST(Statement, SpeaksOfWinnersWithEachSpelling) {
  const auto found = read(
      "winner(/p) = /s\nwinner ( /p )=/s\nwinner(/p) != /s\nwinner(/p) = none\nidle(/p)\n"
      "winner(\"/odd port\\\") = none\n");
  ASSERT_EQ(found.statements.size(), 5u);
  const auto& first = found.statements[0].parsed;
  EXPECT_EQ(show(first.expression), "=0");
  ASSERT_EQ(first.terms.size(), 1u);
  EXPECT_EQ(first.terms[0].port.name, "/p");
  EXPECT_EQ(first.terms[0].port.where, (Location{"safety.txt", 1, 8}));
  EXPECT_EQ(first.terms[0].source->name, "/s");
  EXPECT_EQ(first.terms[0].source->where, (Location{"safety.txt", 1, 14}));
  EXPECT_EQ(show(found.statements[1].parsed.expression), "=0");
  EXPECT_EQ(show(found.statements[2].parsed.expression), "not(=0)");
  EXPECT_FALSE(found.statements[3].parsed.terms[0].source.has_value());
  EXPECT_FALSE(found.statements[4].parsed.terms[0].source.has_value());
}

// Beside winner(/p) some write it so; a condition has the name alone.
TEST(Statement, TakesActiveOfASourceForTheSource) {
  const auto found = read("winner(/p) = /s and not active(/d:o)\nactive ( \"/e:o\" )\n");
  EXPECT_THAT(found.items, IsEmpty());
  ASSERT_EQ(found.statements.size(), 2u);
  EXPECT_EQ(show(found.statements[0].parsed.expression), "(=0 and not(/d:o))");
  ASSERT_EQ(found.statements[0].parsed.sources.size(), 1u);
  EXPECT_EQ(found.statements[0].parsed.sources[0].where, (Location{"safety.txt", 1, 32}));
  EXPECT_EQ(show(found.statements[1].parsed.expression), "/e:o");
}

TEST(Statement, MaySpeakOfOneOfSeveralWinnersAndOfTheSame) {
  const auto found = read(
      "winner(/p) = any(/Nav/*)\nwinner(/p) != any( \"/odd *\" )\nwinner(/p) = winner(/q)\n"
      "winner(/p) != winner (/q) and /s\n");
  EXPECT_THAT(found.items, IsEmpty());
  ASSERT_EQ(found.statements.size(), 4u);
  const auto& any = found.statements[0].parsed;
  EXPECT_EQ(any.terms[0].pattern->name, "/Nav/*");
  EXPECT_EQ(any.terms[0].pattern->where, (Location{"safety.txt", 1, 18}));
  EXPECT_THAT(any.globs, IsEmpty()) << "it ranges over the port's connections";
  EXPECT_EQ(show(found.statements[1].parsed.expression), "not(=0)");
  EXPECT_EQ(found.statements[1].parsed.terms[0].pattern->name, "/odd *");
  EXPECT_EQ(found.statements[2].parsed.terms[0].other_port->name, "/q");
  EXPECT_EQ(found.statements[2].parsed.terms[0].other_port->where, (Location{"safety.txt", 3, 21}));
  EXPECT_EQ(show(found.statements[3].parsed.expression), "(not(=0) and /s)");
}

TEST(Statement, WhatOtherLanguagesWriteIsToldWhatToWriteHere) {
  const std::vector<std::pair<std::string, std::string>> cases{
      {"/a => idle(/p)", "\"=>\" is no operator here; write implies or ->"},
      {"winner(/p) == /s", "\"==\" is no operator here; write = behind winner(…)"},
      {"/a = /b",
       "\"=\" compares a winner, as in winner(/Arm/pos:i) = /Teleop/pos:o; between "
       "conditions write iff"},
      {"/a != /b", "between conditions write xor"},
      {"is_active(/a) -> idle(/p)", "write the name alone"},
      {"active /a -> idle(/p)", "active takes a source in parentheses; write active(/Deadman:o)"},
      {"active(/Nav/*)", "\"*\" has no meaning in a statement"},
      {"winner(/p) = none(/Nav/*)", "write winner(/p) != any(/Nav/*)"},
      {"winner(/p) = all(/Nav/*)", "only one source wins at a port; write any(/Nav/*)"},
      {"winner(/p) = any", "any takes a pattern in parentheses"},
      {"winner(/p) = winner", "winner takes a port in parentheses"},
      {"winner(/p) = idle(/q)", "a source, any(…), winner(…) or none here"},
  };
  for (const auto& [text, advice] : cases) {
    const auto found = read(text + "\n");
    ASSERT_EQ(found.items.size(), 1u) << text;
    EXPECT_EQ(found.items[0].code, "malformed-statement") << text;
    EXPECT_THAT(found.items[0].message, HasSubstr(advice)) << text;
  }
}

TEST(Statement, AWinnerIsAnOperandThatBindsTighterThanNot) {
  const auto found = read("winner(/p) = /a -> not winner(/q) = /b xor idle(/r)");
  ASSERT_EQ(found.statements.size(), 1u);
  EXPECT_EQ(show(found.statements[0].parsed.expression), "(=0 implies (not(=1) xor =2))");
  EXPECT_EQ(found.statements[0].parsed.terms.size(), 3u);
}

TEST(Statement, QuantifiersAndSourcesAreMentionedWithTheirPlaces) {
  const auto found = read("any(/Nav/*) -> /s\n");
  ASSERT_EQ(found.statements.size(), 1u);
  const auto& parsed = found.statements[0].parsed;
  ASSERT_EQ(parsed.globs.size(), 1u);
  EXPECT_EQ(parsed.globs[0].where, (Location{"safety.txt", 1, 5}));
  ASSERT_EQ(parsed.sources.size(), 1u);
  EXPECT_EQ(parsed.sources[0].where, (Location{"safety.txt", 1, 16}));
}

TEST(Statement, WhatIsMalformedIsReportedWithItsPlaceAndTheOthersAreRead) {
  const auto found = read(
      "/a and\n"
      "winner /p = /s\n"
      "winner(/p)\n"
      "winner(/p) = true\n"
      "winner(s) = /s\n"
      "idle(/p\n"
      "Idle(/p)\n"
      "/a = /b\n"
      "/a ->\n   $\n"
      "/fine\n");
  EXPECT_THAT(found.findings(), ElementsAre("1:7 malformed-statement", "2:8 malformed-statement",
                                            "3:11 malformed-statement", "4:14 malformed-statement",
                                            "5:8 malformed-statement", "6:5 malformed-statement",
                                            "7:1 malformed-statement", "8:4 malformed-statement",
                                            "10:4 malformed-statement"));
  ASSERT_EQ(found.statements.size(), 1u);
  EXPECT_THAT(found.items[0].message, HasSubstr("the statement ends where"));
  EXPECT_THAT(found.items[1].message, HasSubstr("write winner(/Arm/pos:i) = /Teleop/pos:o"));
  EXPECT_THAT(found.items[6].message, HasSubstr("write idle for"));
}

TEST(Statement, SaysWhatToWriteForWordsOfOthers) {
  const auto found = read(
      "winner(/p) is /a\n"
      "winner(/p) = nobody\n"
      "wins(/p, /a)\n"
      "always /a\n");
  ASSERT_EQ(found.items.size(), 4u);
  EXPECT_THAT(found.items[0].message, HasSubstr("write = behind winner(…)"));
  EXPECT_THAT(found.items[1].message, HasSubstr("write idle(/Arm/pos:i), or none behind"));
  EXPECT_THAT(found.items[2].message, HasSubstr("write winner(/Arm/pos:i) = /Teleop/pos:o"));
  EXPECT_THAT(found.items[3].message, HasSubstr("must be true in every state: write it alone"));
}

TEST(Statement, ConditionsOfAModelDoNotSpeakOfWinners) {
  const auto loaded = load_text(
      "<behavior name='A'><config at='/p'>/a</config><condition>idle(/p)</condition></behavior>");
  EXPECT_THAT(loaded.findings(), ElementsAre("1:58 error malformed-condition"));
}

TEST(Statement, AFileThatIsNoTextIsAnError) {
  EXPECT_THAT(read("/a\n\xff\n").findings(), ElementsAre("2:1 invalid-character"));
}

TEST(Statement, ThereMayBeSoMany) {
  std::string text;
  for (std::size_t i = 0; i < kMaxStatements + 2; ++i) text += "/a\n";
  const auto found = read(text);
  EXPECT_EQ(found.statements.size(), kMaxStatements);
  EXPECT_THAT(found.findings(), ElementsAre("10001:1 limit-exceeded"));
}

}  // namespace
}  // namespace arbiter::rules
