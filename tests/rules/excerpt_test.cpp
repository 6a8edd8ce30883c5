#include "rules/text/excerpt.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/stat.h>

#include "tests/rules/model_text.hpp"

namespace arbiter::rules {
namespace {

class Excerpt : public testing::Test {
 protected:
  std::string of(const std::string& content, std::uint32_t line, std::uint32_t column) {
    return Excerpts().at({folder_.write("file", content), line, column});
  }

  Folder folder_;
};

TEST_F(Excerpt, IsTheLineWithACaretBelowThePlace) {
  EXPECT_EQ(of("first\n<second here>\nthird\n", 2, 9),
            "    2 | <second here>\n"
            "      |         ^\n");
}

TEST_F(Excerpt, ThePlaceMayBeBehindTheLastByteOfALineOrFile) {
  EXPECT_EQ(of("ab", 1, 3), "    1 | ab\n      |   ^\n");
  EXPECT_EQ(of("", 1, 1), "    1 |\n      | ^\n");
  EXPECT_EQ(of("ab\r\ncd", 1, 3), "    1 | ab\n      |   ^\n");
}

TEST_F(Excerpt, TabsAreBlanksInBothLines) {
  EXPECT_EQ(of("\tx\ty", 1, 4), "    1 |     x   y\n      |         ^\n");
}

TEST_F(Excerpt, CaretsStandBelowCharactersAndNotBytes) {
  EXPECT_EQ(of("¬ä→x", 1, 8), "    1 | ¬ä→x\n      |    ^\n");
  EXPECT_EQ(of("眼x", 1, 4), "    1 | 眼x\n      |   ^\n");
  EXPECT_EQ(of("e\xcc\x81x", 1, 4), "    1 | e\xcc\x81x\n      |  ^\n");
}

TEST_F(Excerpt, WhatATerminalWouldActUponIsNotShown) {
  EXPECT_EQ(of("a\x1b[31mb\xff\xe2\x80\xae"
               "c",
               1, 11),
            "    1 | a\xef\xbf\xbd[31mb\xef\xbf\xbd\xef\xbf\xbd"
            "c\n      |          ^\n");
}

TEST_F(Excerpt, OfALongLineAsMuchAsFitsAroundThePlace) {
  const std::string excerpt = of(std::string(300, 'a') + "X" + std::string(300, 'b'), 1, 301);
  const std::string a(50, 'a'), b(49, 'b');
  EXPECT_EQ(excerpt, "    1 | …" + a + "X" + b + "…\n      |  " + std::string(50, ' ') + "^\n");
}

TEST_F(Excerpt, OfAnEndlessLineNoMoreThanItsPart) {
  std::string line(3'000'000, 'a');
  line[2'000'000] = 'X';
  const std::string excerpt = of(line, 1, 2'000'001);
  EXPECT_LT(excerpt.size(), 300u);
  EXPECT_NE(excerpt.find("aXa"), std::string::npos);
  const std::size_t x = excerpt.find('X'), caret = excerpt.find('^') - excerpt.find('\n') - 1;
  EXPECT_EQ(x - std::string("…").size() + 1, caret);  // it takes one column, and three bytes
}

TEST_F(Excerpt, ThereIsNoneOfAPlaceThatTheFileDoesNotHave) {
  EXPECT_EQ(of("one\n", 3, 1), "");
  EXPECT_EQ(of("one\n", 1, 9), "");
  EXPECT_EQ(Excerpts().at({folder_.file("none"), 1, 1}), "");
}

TEST_F(Excerpt, APipeIsNotReadAgain) {
  const std::string path = folder_.file("pipe");
  ASSERT_EQ(::mkfifo(path.c_str(), 0600), 0);
  EXPECT_EQ(Excerpts().at({path, 1, 1}), "");
}

TEST_F(Excerpt, AFileIsReadOnce) {
  Excerpts excerpts;
  const std::string path = folder_.write("file", "before\nx\n");
  excerpts.at({path, 1, 1});
  folder_.write("file", "after\n");
  EXPECT_EQ(excerpts.at({path, 2, 1}), "    2 | x\n      | ^\n");
}

}  // namespace
}  // namespace arbiter::rules
