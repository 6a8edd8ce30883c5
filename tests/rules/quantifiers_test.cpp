#include "rules/model/quantifiers.hpp"

#include <gmock/gmock.h>

#include <random>
#include <string>
#include <vector>

#include "tests/rules/model_text.hpp"

namespace arbiter::rules {
namespace {

using testing::ElementsAre;

TEST(Glob, KnowsNoSpecialCharacterButTheStar) {
  struct Case {
    std::string pattern, name;
    bool fits;
  };
  const std::vector<Case> cases{
      {"*", "/Face/pos:o", true},
      {"*", "", true},
      {"", "", true},
      {"", "/a", false},
      {"/Face/*", "/Face/pos:o", true},
      {"/Face/*", "/Face/", true},
      {"/Face/*", "/Face", false},
      {"/Face*", "/Face", true},
      {"*:o", "/a/b/c:o", true},
      {"*:o", "/a:i", false},
      {"/*/pos:o", "/a/b/pos:o", true},
      {"/a", "/a", true},
      {"/a", "/ab", false},
      {"/a", "/A", false},
      {"/a?", "/ab", false},
      {"/a?", "/a?", true},
      {"/[ab]", "/a", false},
      {"/a.c", "/abc", false},
      {"**/**", "/", true},
      {"*a*b*", "/xaxxbx", true},
      {"*a*b*", "/xbxxax", false},
      {"/aa*aa", "/aaa", false},
      {"/aa*aa", "/aaaa", true},
      {"\\*", "*", false},
  };
  for (const Case& c : cases) {
    EXPECT_EQ(matches(c.pattern, c.name), c.fits) << c.pattern << " on " << c.name;
  }
}

bool matches_naively(std::string_view pattern, std::string_view name) {
  if (pattern.empty()) return name.empty();
  if (pattern[0] == '*') {
    for (std::size_t i = 0; i <= name.size(); ++i) {
      if (matches_naively(pattern.substr(1), name.substr(i))) return true;
    }
    return false;
  }
  return !name.empty() && pattern[0] == name[0] &&
         matches_naively(pattern.substr(1), name.substr(1));
}

TEST(Glob, AgreesWithTheNaiveOneOnRandomPatterns) {
  std::mt19937 random(20240229);
  const auto draw = [&](std::string_view letters) {
    std::string text;
    for (std::size_t left = random() % 8; left > 0; --left) {
      text += letters[random() % letters.size()];
    }
    return text;
  };
  for (int i = 0; i < 20'000; ++i) {
    const std::string pattern = draw("ab*"), name = draw("ab");
    ASSERT_EQ(matches(pattern, name), matches_naively(pattern, name)) << pattern << " on " << name;
  }
}

TEST(Glob, IsQuickOnPatternsMadeToBeSlow) {
  std::string pattern;
  for (int i = 0; i < 2000; ++i) pattern += "*a";
  EXPECT_FALSE(matches(pattern + "b", std::string(4000, 'a')));
}

std::string rule_for(const std::string& condition) {
  const Loaded loaded = load_text(
      "<behaviors><source port='/D/declared'/>"
      "<behavior name='B'><config at='/in'>/B/config</config></behavior>"
      "<behavior name='C'><condition>/C/condition or not /C/sensed</condition></behavior>"
      "<arbiter at='/in2'><select from='/S/from'>/S/rule</select></arbiter>"
      "<arbiter at='/p'><select from='/B/config'>" +
      condition + "</select></arbiter></behaviors>");
  EXPECT_FALSE(loaded.has_errors) << loaded.message();
  return show_rules(loaded, "/p").at(0).substr(std::string("/B/config: ").size());
}

TEST(Quantifiers, RangeOverAllSourcesThatTheModelNamesInByteOrder) {
  EXPECT_EQ(rule_for("any(*)"),
            "(/B/config or /C/condition or /C/sensed or /D/declared or /S/from or /S/rule)");
  EXPECT_EQ(rule_for("all(/C/*)"), "(/C/condition and /C/sensed)");
  EXPECT_EQ(rule_for("none(/C/*)"), "(not(/C/condition) and not(/C/sensed))");
  EXPECT_EQ(rule_for("any(/in*)"), "false") << "input ports are no sources";
}

TEST(Quantifiers, OverOneMatchAreThatOne) {
  EXPECT_EQ(rule_for("any(/D/*)"), "/D/declared");
  EXPECT_EQ(rule_for("all(/D/*)"), "/D/declared");
  EXPECT_EQ(rule_for("none(/D/*)"), "not(/D/declared)");
}

TEST(Quantifiers, OverNoMatchAreFalseTrueTrue) {
  EXPECT_EQ(rule_for("any(/nothing/*)"), "false");
  EXPECT_EQ(rule_for("all(/nothing/*)"), "true");
  EXPECT_EQ(rule_for("none(/nothing/*)"), "true");
}

TEST(Quantifiers, OverNoMatchAreWarnedOf) {
  const Loaded loaded = load_text(R"(<behaviors>
    <source port="/Lock/a:o"/>
    <behavior name="A"><config at="/P:i">/a:o</config>
      <condition>none(/Lokc/*) or any(/Lock/*)</condition></behavior>
  </behaviors>)");
  ASSERT_EQ(loaded.items.size(), 1u);
  const Diagnostic& warning = loaded.items[0];
  EXPECT_EQ(warning.code, "matches-nothing");
  EXPECT_THAT(warning.message, testing::HasSubstr("\"/Lokc/*\""));
  EXPECT_THAT(warning.message, testing::HasSubstr("did you mean \"/Lock/*\"?"));
  EXPECT_EQ(warning.where.line, 4u);
  EXPECT_EQ(warning.where.column, 23u);
}

TEST(Quantifiers, MayStandInsideOtherOperators) {
  EXPECT_EQ(rule_for("/x and not any(/C/*)"), "(/x and not((/C/condition or /C/sensed)))");
  EXPECT_EQ(rule_for("any(\"/D/*\") -&gt; /x"), "(/D/declared implies /x)");
}

TEST(Quantifiers, RangeOverTheSourcesOfAllFiles) {
  const Loaded loaded =
      load_texts({"<arbiter at='/p'><select from='/a/1'>none(/a/*)</select></arbiter>",
                  "<source port='/a/2'/>"});
  EXPECT_THAT(show_rules(loaded, "/p"), ElementsAre("/a/1: (not(/a/1) and not(/a/2))"));
  EXPECT_THAT(loaded.rules.sources, ElementsAre("/a/1", "/a/2"));
}

TEST(SimilarPattern, NamesPartsThatExist) {
  const std::vector<std::string_view> names{"/Base/cmd:i", "/BaseLeft/cmd:i", "/gaze:i",
                                            "/Head/Gaze/pos:i"};
  const std::vector<std::pair<std::string, std::string>> cases{{"Base*", "/Base*"},
                                                               {"Base/*", "/Base/*"},
                                                               {"/Bse/*", "/Base/*"},
                                                               {"/Bsae*", "/Base*"},
                                                               {"/base*", "/Base*"},
                                                               {"/gaez*", "/gaze*"},
                                                               {"/Haed/*", "/Head/*"},
                                                               {"/Head/Gzae*", "/Head/Gaze*"},
                                                               {"Head/Gaze/*", "/Head/Gaze/*"},
                                                               {"/Gaze/po:i", ""},
                                                               {"/Arm/*", ""},
                                                               {"*x", ""},
                                                               {"/bse/cmd:i", "/Base/cmd:i"}};
  for (const auto& [typed, meant] : cases) EXPECT_EQ(similar_pattern(typed, names), meant) << typed;
}

}  // namespace
}  // namespace arbiter::rules
