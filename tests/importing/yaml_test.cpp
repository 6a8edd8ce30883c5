#include "importing/yaml.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <string>

namespace arbiter::importing {
namespace {

using testing::HasSubstr;

struct Parsed {
  std::optional<YamlNode> root;
  rules::Diagnostics diagnostics;

  // "line:column", then the message.
  [[nodiscard]] std::string error() const {
    if (diagnostics.items().size() != 1) return "not one error";
    const auto& item = diagnostics.items().front();
    return std::to_string(item.where.line) + ":" + std::to_string(item.where.column) + " " +
           item.message;
  }
};

Parsed parse(const std::string& text) {
  Parsed result;
  const rules::TextFile file("m.yaml", text);
  result.root = parse_yaml(file, result.diagnostics);
  return result;
}

std::string repeated(const std::string& text, int count) {
  std::string result;
  for (; count > 0; --count) result += text;
  return result;
}

TEST(Yaml, EverythingKnowsItsPlace) {
  const auto parsed = parse("# a comment\ntopics:\n  \"é\": {a: 1}\n  b:\n    - x\n    - 'y z'\n");
  ASSERT_TRUE(parsed.root) << parsed.error();
  const YamlEntry* topics = parsed.root->find("topics");
  ASSERT_NE(topics, nullptr);
  EXPECT_EQ(topics->key.where, (rules::Location{"m.yaml", 2, 1}));
  const YamlEntry* e = topics->value.find("é");
  ASSERT_NE(e, nullptr);
  EXPECT_EQ(e->key.where, (rules::Location{"m.yaml", 3, 3}));
  // In bytes, of which the letter before it has two.
  EXPECT_EQ(e->value.find("a")->value.where, (rules::Location{"m.yaml", 3, 13}));
  const YamlNode& list = topics->value.find("b")->value;
  ASSERT_EQ(list.items.size(), 2u);
  EXPECT_EQ(list.items[1].where, (rules::Location{"m.yaml", 6, 7}));
  EXPECT_TRUE(list.items[0].is_plain);
  EXPECT_FALSE(list.items[1].is_plain);
  EXPECT_EQ(list.items[1].text, "y z");
}

TEST(Yaml, NothingIsNull) {
  const auto parsed = parse("a:\nb: ~\nc: null\nd: ''\ne: 0\n");
  ASSERT_TRUE(parsed.root);
  EXPECT_TRUE(parsed.root->find("a")->value.is_null());
  EXPECT_TRUE(parsed.root->find("b")->value.is_null());
  EXPECT_TRUE(parsed.root->find("c")->value.is_null());
  EXPECT_FALSE(parsed.root->find("d")->value.is_null());
  EXPECT_FALSE(parsed.root->find("e")->value.is_null());
  EXPECT_EQ(parsed.root->find("f"), nullptr);
}

TEST(Yaml, WindowsLineEndsAndAByteOrderMarkCountAsTheyShould) {
  const auto parsed = parse(
      "\xef\xbb\xbf"
      "a: 1\r\nb: 2\r\n");
  ASSERT_TRUE(parsed.root) << parsed.error();
  EXPECT_EQ(parsed.root->find("b")->value.where, (rules::Location{"m.yaml", 2, 4}));
  EXPECT_EQ(parsed.root->find("b")->value.text, "2");
}

TEST(Yaml, WhatIsMalformedHasAPlaceAndAReason) {
  EXPECT_THAT(parse("a: [1, 2\nb: 3\n").error(), HasSubstr("2:2 this is no YAML: "));
  EXPECT_THAT(parse("a: 'x\n").error(), HasSubstr("2:1 this is no YAML: found unexpected end"));
  EXPECT_THAT(parse("a: 1\n\tb: 2\n").error(), HasSubstr("2:1 a tab is no indentation"));
  EXPECT_THAT(parse("").error(), HasSubstr("the file is empty"));
  EXPECT_THAT(parse("# nothing\n").error(), HasSubstr("the file is empty"));
}

TEST(Yaml, WhatReadersTakeDifferentlyIsRefused) {
  EXPECT_EQ(parse("a: &x 1\nb: *x\n").error(),
            "2:4 an alias refers to what stands elsewhere; write it out here");
  EXPECT_THAT(parse("a: {<<: {b: 1}}\n").error(), HasSubstr("1:5 a merge key"));
  EXPECT_THAT(parse("a: !!float 1\n").error(), HasSubstr("1:4 a tag says"));
  EXPECT_THAT(parse("a: !!set {x}\n").error(), HasSubstr("1:4 a tag says"));
  EXPECT_THAT(parse("a: !x [x]\n").error(), HasSubstr("1:4 a tag says"));
  EXPECT_THAT(parse("? [a]\n: 1\n").error(), HasSubstr("1:3 a key is a list or a map here"));
  EXPECT_EQ(parse("a: 1\nb: 2\na: 3\n").error(), "3:1 the key \"a\" is given twice; remove one");
  EXPECT_THAT(parse("a: 1\n---\nb: 2\n").error(), HasSubstr("2:1 a second document"));
}

TEST(Yaml, NothingMakesItLarge) {
  // Nine levels of nine aliases each would be 400 million words.
  std::string bomb = "a0: &a0 [x,x,x,x,x,x,x,x,x]\n";
  for (int i = 1; i < 9; ++i) {
    const std::string before = "*a" + std::to_string(i - 1);
    bomb += "a" + std::to_string(i) + ": &a" + std::to_string(i) + " [" + before +
            repeated("," + before, 8) + "]\n";
  }
  EXPECT_THAT(parse(bomb).error(), HasSubstr("an alias"));
  EXPECT_THAT(parse(repeated("[", 100'000)).error(), HasSubstr("nested more than 32 deep"));
  EXPECT_THAT(parse(repeated("{a: ", 100'000)).error(), HasSubstr("nested more than 32 deep"));
  EXPECT_THAT(parse(repeated("- ", 100'000)).error(), HasSubstr("nested more than 32 deep"));
  EXPECT_THAT(parse(repeated("? ", 100'000)).error(), HasSubstr("a key is a list or a map"));
  EXPECT_THAT(parse("[" + repeated("x,", 60'000) + "]").error(),
              HasSubstr("more than 50000 values"));
  EXPECT_THAT(parse(repeated("# much\n", 200'000)).error(), HasSubstr("larger than the limit"));
}

// Which libyaml compares with each other: a mebibyte of them took a quarter of a minute.
TEST(Yaml, FewTagDirectivesAreTaken) {
  std::string directives;
  for (int i = 0; i < 10; ++i) directives += "%TAG !" + std::to_string(i) + "! x\n";
  EXPECT_TRUE(parse(directives + "---\na: 1\n").root);
  EXPECT_EQ(parse(directives + "%TAG !z! x\n---\na: 1\n").error(),
            "11:1 the file has more than 10 times %TAG; remove all of them");
}

TEST(Yaml, WhatIsNoTextIsRefused) {
  EXPECT_THAT(parse(std::string("a: \0", 4)).error(), HasSubstr("1:4 "));
  EXPECT_THAT(parse("a: \x1b[31m\n").error(), HasSubstr("1:4 "));
  EXPECT_THAT(parse("a: \xff\xfe\n").error(), HasSubstr("1:4 "));
  EXPECT_THAT(parse("\xff\xfe"
                    "a")
                  .error(),
              HasSubstr("1:1 "));
}

}  // namespace
}  // namespace arbiter::importing
