#include "rules/model/condition_parser.hpp"

#include <gmock/gmock.h>

#include <algorithm>
#include <random>
#include <sstream>
#include <string>
#include <utility>
#include <vector>

#include "tests/rules/model_text.hpp"
#include "tests/support/meaning.hpp"

namespace arbiter::rules {
namespace {

using testing::HasSubstr;

struct Parsed {
  std::optional<ExpressionPtr> expression;
  Diagnostics diagnostics;

  [[nodiscard]] std::string shown() const {
    return expression ? show(*expression) : diagnostics.items().at(0).message;
  }
};

Parsed parse(const std::string& condition) {
  const TextFile file("c", condition);
  Text text(file, 0);
  text.append(file.content(), 0);
  Parsed parsed;
  parsed.expression = parse_condition(text, parsed.diagnostics);
  return parsed;
}

TEST(Condition, HasTheStructureThatPrecedenceGives) {
  const std::vector<std::pair<std::string, std::string>> cases{
      {"/a", "/a"},
      {"true", "true"},
      {"false", "false"},
      {"not /a", "not(/a)"},
      {"not not /a", "not(not(/a))"},
      {"((/a))", "/a"},
      {"/a and /b", "(/a and /b)"},
      {"/a and /b and /c", "(/a and /b and /c)"},
      {"/a or /b or /c", "(/a or /b or /c)"},
      {"/a or /b and /c or /d", "(/a or (/b and /c) or /d)"},
      {"/a and not /b and /c", "(/a and not(/b) and /c)"},
      {"(/a or /b) and /c", "((/a or /b) and /c)"},
      {"not (/a or /b)", "not((/a or /b))"},
      {"/a implies /b implies /c", "(/a implies (/b implies /c))"},
      {"/a iff /b iff /c", "((/a iff /b) iff /c)"},
      {"/a xor /b xor /c", "((/a xor /b) xor /c)"},
      {"/a iff /b implies /c or /d xor /e and not /f",
       "(/a iff (/b implies (/c or (/d xor (/e and not(/f))))))"},
      {"not /a and /b xor /c or /d implies /e iff /f",
       "(((((not(/a) and /b) xor /c) or /d) implies /e) iff /f)"},
      {"/a implies /b iff /c implies /d", "((/a implies /b) iff (/c implies /d))"},
      {"any(/a*) and none(*)", "(any(/a*) and none(*))"},
      {"all(\"/ä*\")", "all(/ä*)"},
      {"any ( *:o )", "any(*:o)"},
      {"any(Face)", "any(Face)"},
  };
  for (const auto& [condition, structure] : cases) {
    EXPECT_EQ(parse(condition).shown(), structure) << condition;
  }
}

TEST(Condition, TakesEverySpellingOfEachOperator) {
  const std::vector<std::pair<std::string, std::vector<std::string>>> spellings{
      {"iff", {"iff", "<->", "↔"}},     {"implies", {"implies", "->", "→"}},
      {"or", {"or", "|", "||", "∨"}},   {"xor", {"xor"}},
      {"and", {"and", "&", "&&", "∧"}},
  };
  for (const auto& [name, all] : spellings) {
    for (const std::string& spelling : all) {
      EXPECT_EQ(parse("/a " + spelling + " /b").shown(), "(/a " + name + " /b)") << spelling;
      // All spellings of one operator bind alike, and may be mixed.
      EXPECT_EQ(parse("/a " + spelling + " /b " + all[0] + " /c").shown(),
                parse("/a " + all[0] + " /b " + all[0] + " /c").shown());
    }
  }
  for (const std::string spelling : {"not ", "!", "~", "¬", "! ", "not\t"}) {
    EXPECT_EQ(parse(spelling + "/a").shown(), "not(/a)") << spelling;
  }
}

TEST(Condition, NeedsNoBlanksWhereNothingElseCanBeMeant) {
  const std::vector<std::pair<std::string, std::string>> cases{
      {"/a->/b", "(/a implies /b)"},
      {"/a-b", "/a-b"},
      {"/a<->/b", "(/a iff /b)"},
      {"/a-->/b", "(/a- implies /b)"},
      {"/a-b->/c-d", "(/a-b implies /c-d)"},
      {"/a-/b", "/a-/b"},
      {"/a&/b|/c", "((/a and /b) or /c)"},
      {"/a&&!/b", "(/a and not(/b))"},
      {"not/a", "not(/a)"},
      {"!(/a)or(/b)", "(not(/a) or /b)"},
      {"/a∧/b∨¬/c", "((/a and /b) or not(/c))"},
      {"\"/a\"and\"/b\"", "(/a and /b)"},
  };
  for (const auto& [condition, structure] : cases) {
    EXPECT_EQ(parse(condition).shown(), structure) << condition;
  }
}

TEST(Condition, NamesTakeLettersDigitsAndSomePunctuation) {
  EXPECT_EQ(parse("/Az09_.:/-x").shown(), "/Az09_.:/-x");
  EXPECT_EQ(parse("/and and /or").shown(), "(/and and /or)");
  EXPECT_EQ(parse("\"/größe+1@(x)\"").shown(), "/größe+1@(x)");
  EXPECT_EQ(parse("\n\t/a\r\n and\n/b ").shown(), "(/a and /b)");
}

// Evaluates the words of a condition by splitting them at the loosest operator outside of
// parentheses: slow, obvious, and nothing like the parser.
class NaiveEvaluation {
 public:
  explicit NaiveEvaluation(const std::string& condition) {
    std::istringstream stream(condition);
    for (std::string word; stream >> word;) words_.push_back(word);
  }

  [[nodiscard]] bool result(unsigned active) {
    active_ = active;
    return of(0, words_.size());
  }

 private:
  [[nodiscard]] bool of(std::size_t first, std::size_t last) const {
    // {operator, whether the last one splits (left-associative), else the first}
    static const std::vector<std::pair<std::string, bool>> kLoosestFirst{
        {"iff", true}, {"implies", false}, {"or", true}, {"xor", true}, {"and", true}};
    for (const auto& [op, splits_at_last] : kLoosestFirst) {
      const std::size_t at = find(op, first, last, splits_at_last);
      if (at == last) continue;
      const bool a = of(first, at), b = of(at + 1, last);
      if (op == "iff") return a == b;
      if (op == "implies") return !a || b;
      if (op == "or") return a || b;
      if (op == "xor") return a != b;
      return a && b;
    }
    const std::string& word = words_[first];
    if (word == "not") return !of(first + 1, last);
    if (word == "(") return of(first + 1, last - 1);
    if (word == "true" || word == "false") return word == "true";
    return (active_ >> (word[1] - 'a') & 1) != 0;
  }

  [[nodiscard]] std::size_t find(const std::string& op, std::size_t first, std::size_t last,
                                 bool from_behind) const {
    std::size_t found = last;
    int depth = 0;
    for (std::size_t i = first; i < last; ++i) {
      if (words_[i] == "(") ++depth;
      if (words_[i] == ")") --depth;
      if (depth != 0 || words_[i] != op) continue;
      found = i;
      if (!from_behind) break;
    }
    return found;
  }

  std::vector<std::string> words_;
  unsigned active_ = 0;
};

test::Active names_of(unsigned active) {
  test::Active names;
  for (char letter = 'a'; letter <= 'z'; ++letter) {
    if ((active >> (letter - 'a') & 1) != 0) names.insert(std::string("/") + letter);
  }
  return names;
}

void expect_same_meaning(const std::string& condition, unsigned sources) {
  const Parsed parsed = parse(condition);
  ASSERT_TRUE(parsed.expression) << condition << ": " << parsed.shown();
  NaiveEvaluation naive(condition);
  for (unsigned active = 0; active < 1u << sources; ++active) {
    ASSERT_EQ(test::holds(**parsed.expression, names_of(active)), naive.result(active))
        << condition << " with " << active;
  }
}

constexpr const char* kBinary[] = {"iff", "implies", "or", "xor", "and"};

TEST(Condition, MeansWhatEachPairOfOperatorsSays) {
  for (const std::string first : kBinary) {
    for (const std::string second : kBinary) {
      for (const std::string third : kBinary) {
        expect_same_meaning("/a " + first + " /b " + second + " not /c " + third + " /d", 4);
      }
      expect_same_meaning("not /a " + first + " /b " + second + " /c", 3);
      expect_same_meaning("not ( /a " + first + " /b ) " + second + " /c", 3);
      expect_same_meaning("/a " + first + " ( /b " + second + " /c )", 3);
    }
  }
}

std::string draw_condition(std::mt19937& random, int depth) {
  static constexpr const char* kOperands[] = {"/a", "/b", "/c", "/d", "/e", "true", "false"};
  std::string condition;
  for (bool more = true; more;) {
    if (random() % 4 == 0) condition += "not ";
    if (depth > 0 && random() % 3 == 0) {
      condition += "( " + draw_condition(random, depth - 1) + " )";
    } else {
      condition += kOperands[random() % 7];
    }
    more = random() % 3 != 0;
    if (more) condition += std::string(" ") + kBinary[random() % 5] + " ";
  }
  return condition;
}

TEST(Condition, MeansWhatTheNaiveEvaluationSaysOfRandomOnes) {
  constexpr unsigned kSeed = 4711;
  std::mt19937 random(kSeed);
  for (int i = 0; i < 1'000; ++i) {
    expect_same_meaning(draw_condition(random, 3), 5);
    if (HasFatalFailure()) FAIL() << "seed " << kSeed << ", condition " << i;
  }
}

TEST(Condition, MalformedIsReportedAtTheByteThatIsWrong) {
  struct Case {
    std::string condition;
    unsigned column;
    std::string message;
  };
  const std::vector<Case> cases{
      {"/a and", 7, "the condition ends where a port's name"},
      {"/a and and /b", 8, "\"and\" stands where a port's name"},
      {"and /a", 1, "\"and\" stands where"},
      {"/a /b", 4, "an operator is missing before \"/b\""},
      {"/a not /b", 4, "an operator is missing before \"not\""},
      {"(/a", 1, "this '(' is not closed"},
      {"/b and ((/a or /b)", 8, "this '(' is not closed"},
      {"(/a /b)", 5, "the ')' of c:1:1, is missing before \"/b\""},
      {"/a)", 3, "this ')' closes nothing"},
      {"()", 2, "\")\" stands where"},
      {"not", 4, "the condition ends"},
      {"/a AND /b", 4, "lower case; write and for \"AND\""},
      {"Not/a", 1, "lower case; write not"},
      {"/a implys /b", 4, "did you mean \"implies\"?"},
      {"Face/pos:o", 1, "names begin with '/'"},
      {"/a -> b", 7, "\"b\" is neither a keyword"},
      {"/a->b", 5, "\"b\" is neither a keyword"},
      {"/a = /b", 4, "\"=\" is no operator here; write iff"},
      {"/a == /b", 4, "\"==\" is no operator here; write iff"},
      {"/a != /b", 4, "\"!=\" is no operator here; write xor"},
      {"/a => /b", 4, "\"=>\" is no operator here; write implies or ->"},
      {"/a<=>/b", 3, "\"<=>\" is no operator here; write iff"},
      {"/a ⇒ /b", 4, "\"⇒\" is no operator here; write implies or ->"},
      {"/a ⊕ /b", 4, "\"⊕\" is no operator here; write xor"},
      {"/b and active(/a)", 8, "write the name alone"},
      {"not Active(/a)", 5, "\"Active\" is no keyword here; a source's name by itself says that"},
      {"is_active(/a)", 1, "write the name alone"},
      {"inactive(/a)", 1, "write not and the source's name"},
      {"exists(/Nav/*)", 1, "write any(/Nav/*)"},
      {"if /a then /b", 1, "write implies or ->"},
      {"winner(/p) = /a", 1, "a condition reads which sources are active, and not who wins"},
      {"/a unless /b", 4,
       "\"unless\" is no keyword here; write and not (…) around all that follows"},
      {"Face/pos:o", 1, "names begin with '/': write \"/Face/pos:o\""},
      {"/a for 5s", 4, "how long a source stays active says the timeout of its <source>"},
      {"1 or /a", 1, "write true"},
      {"never /a", 1, "\"never\" is no keyword here; write not"},
      {"any(/a/*, /b/*)", 9, "a quantifier for each pattern: any(/Nav/*) or any(/Op/*)"},
      {"/a < /b", 4, "\"<\" has no meaning"},
      {"/größe", 4, "\"ö\" has no meaning in a condition; remove it, or put the name"},
      {"/a*", 3, "\"*\" has no meaning in a condition; where a pattern is meant, write any("},
      {"$a", 1, "a define is used as ${name}"},
      {"/a, /b", 3, "write and, or or, between two conditions"},
      {"\"/a", 1, "this quoted name does not end"},
      {"/b or \"\"", 7, "this name is empty"},
      {"\"a\"", 2, "a port's name begins with '/'"},
      {"/b or \"/a b\"", 10, "has white space in it"},
      {"any /a", 5, "any takes a pattern in parentheses"},
      {"any", 4, "any takes a pattern in parentheses"},
      {"any()", 5, "a pattern is expected here"},
      {"any(/a", 4, "this '(' is not closed"},
      {"any(/a /b)", 8, "is missing before \"/b\""},
      {"all(?)", 5, "a pattern is expected here"},
      {"none(\"/a)", 6, "does not end"},
      {"any(any(/a))", 8, "is missing before \"(\""},
      {"/a ->", 6, "the condition ends"},
      {"-> /a", 1, "\"->\" stands where"},
      {"- /a", 1, "\"-\" is neither a keyword"},
  };
  for (const Case& c : cases) {
    const Parsed parsed = parse(c.condition);
    ASSERT_FALSE(parsed.expression) << c.condition;
    ASSERT_EQ(parsed.diagnostics.items().size(), 1u) << c.condition;
    const Diagnostic& item = parsed.diagnostics.items()[0];
    EXPECT_EQ(item.where, (Location{"c", 1, c.column})) << c.condition << ": " << item.message;
    EXPECT_THAT(item.message, HasSubstr(c.message)) << c.condition;
    EXPECT_THAT(item.code, testing::AnyOf("malformed-condition", "invalid-port-name"));
  }
}

std::string repeat(const std::string& text, int times) {
  std::string result;
  for (int i = 0; i < times; ++i) result += text;
  return result;
}

TEST(Condition, MayBeNestedUpToALimit) {
  const int most = kMaxConditionDepth;
  for (const std::string& condition : {
           repeat("(", most) + "/a" + repeat(")", most),
           repeat("not ", most - 1) + "/a",
           repeat("/a implies ", most - 1) + "/a",
           repeat("/a xor ", most - 1) + "/a",
           repeat("/a and (/b or ", most / 2 - 1) + "/c" + repeat(")", most / 2 - 1),
           repeat("/a and ", 10'000) + "/a",
       }) {
    EXPECT_TRUE(parse(condition).expression) << condition.substr(0, 20);
  }
}

TEST(Condition, NestedDeeperIsRefusedAndNeverOverflowsTheStack) {
  for (const int times : {kMaxConditionDepth + 1, 200'000}) {
    for (const std::string& condition : {
             repeat("(", times) + "/a" + repeat(")", times),
             repeat("(", times),
             repeat("not ", times) + "/a",
             repeat("!", times) + "/a",
             repeat("not (", times) + "/a" + repeat(")", times),
             repeat("/a implies ", times) + "/a",
             repeat("/a iff ", times) + "/a",
             repeat("/a xor ", times) + "/a",
             repeat("/a iff /a implies /a or /a xor /a and (", times),
         }) {
      const Parsed parsed = parse(condition);
      ASSERT_FALSE(parsed.expression) << condition.substr(0, 20);
      const Diagnostic& item = parsed.diagnostics.items().at(0);
      EXPECT_EQ(item.code, "limit-exceeded") << condition.substr(0, 20) << item.message;
      EXPECT_THAT(item.message, HasSubstr("nested deeper than the limit of 500"));
    }
  }
}

// The places of errors in the file, however the condition came to be.
TEST(Condition, InAFileIsReportedWhereItStandsInTheFile) {
  struct Case {
    std::string condition;
    std::string place;  // the condition begins at 1:39
    std::string message;
  };
  const std::vector<Case> cases{
      {"/a and", "1:45", "the condition ends"},
      {"/a and ", "1:46", "the condition ends"},
      {"\n  /a\n  oder /b", "3:3", "neither"},
      {"\r\n  /a\r\n  oder /b", "3:3", "neither"},
      {"/a &amp;&amp; oder", "1:53", "neither"},
      {"/a &lt;-&gt; oder", "1:52", "neither"},
      {"/a &amp; &amp;", "1:48", "\"&\" stands where"},
      {"&#x2f;a oder", "1:47", "neither"},
      {"<![CDATA[/a && oder]]>", "1:54", "neither"},
      {"/a <!-- not this --> oder", "1:60", "neither"},
      {"/a <![CDATA[<-> ]]>oder", "1:58", "neither"},
      {"${half} /b oder", "1:50", "\"oder\" is neither"},
      {"/b ${bad}", "1:42", "did you mean \"or\"? (in the text of ${bad})"},
      {"${half}", "1:46", "the condition ends where"},
      {"${half}", "1:46", " (in the text of ${half})"},
      {"/b and ${half} /c) and /b", "1:56", "this ')' closes nothing"},
  };
  for (const Case& c : cases) {
    SCOPED_TRACE(c.condition);
    const Loaded loaded = load_texts(
        {"<define name='half'>/a and</define><define name='bad'>odor</define>",
         "<arbiter at='/in'><select from='/frm'>" + c.condition + "</select></arbiter>"});
    ASSERT_EQ(loaded.items.size(), 1u) << loaded.message();
    const Location& where = loaded.items[0].where;
    EXPECT_EQ(std::to_string(where.line) + ":" + std::to_string(where.column), c.place);
    EXPECT_THAT(loaded.message(), HasSubstr(c.message));
  }
}

}  // namespace
}  // namespace arbiter::rules
