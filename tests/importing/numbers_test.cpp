#include "importing/numbers.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "importing/entries.hpp"

namespace arbiter::importing {
namespace {

using testing::HasSubstr;

YamlNode plain(const std::string& text) {
  YamlNode node;
  node.text = text;
  node.is_plain = true;
  return node;
}

std::string problem_of_seconds(const std::string& text) {
  const auto number = read_seconds(plain(text));
  EXPECT_EQ(number.value.has_value(), number.problem.empty());
  return number.problem;
}

TEST(Numbers, SecondsAreExactToTheNanosecond) {
  const std::vector<std::pair<std::string, shm::Nanoseconds>> cases{
      {"0.5", 500'000'000},
      {"0.1", 100'000'000},
      {"0.29", 290'000'000},
      {"0.7", 700'000'000},
      {"1", 1'000'000'000},
      {"+2.5", 2'500'000'000},
      {".25", 250'000'000},
      {"1.", 1'000'000'000},
      {"5.0e-1", 500'000'000},
      {"2.5e+1", 25'000'000'000},
      {"0.000000001", 1},
      {"0.0", 0},
      {"0", 0},
      {"-0.0", 0},
      {"-1.5", -1'500'000'000},
      {"0.333333333", 333'333'333},
      {"1000000000.0", 1'000'000'000'000'000'000}};
  for (const auto& [text, expected] : cases) {
    const auto number = read_seconds(plain(text));
    ASSERT_TRUE(number.value) << text << ": " << number.problem;
    EXPECT_EQ(*number.value, expected) << text;
  }
}

TEST(Numbers, WhatIsNoNumberOfSecondsSaysWhy) {
  for (const char* text :
       {".nan", ".inf", "-.inf", "nan", "inf", "infinity", "0x10", "0o7", "1_000", "0.5s", "half",
        "1:30", "--1", "+-1", "+", "-", ".", "e5", "true"}) {
    EXPECT_THAT(problem_of_seconds(text), HasSubstr("is not a number")) << text;
  }
  for (const char* text : {"5e-1", "1e3", "1.0e3", "1E+1", "-.5", "+.5"}) {
    EXPECT_THAT(problem_of_seconds(text), HasSubstr("is a text to some readers")) << text;
  }
  EXPECT_THAT(problem_of_seconds("010"), HasSubstr("octal"));
  EXPECT_THAT(problem_of_seconds("1e999"), HasSubstr("out of range"));
  EXPECT_THAT(problem_of_seconds("-1e999"), HasSubstr("out of range"));
  EXPECT_THAT(problem_of_seconds("1000000001"), HasSubstr("out of range"));
  EXPECT_THAT(problem_of_seconds("1.0e-12"), HasSubstr("less than a nanosecond"));
  EXPECT_THAT(problem_of_seconds(""), HasSubstr("no value"));
  EXPECT_THAT(problem_of_seconds("~"), HasSubstr("no value"));
  YamlNode quoted = plain("0.5");
  quoted.is_plain = false;
  EXPECT_THAT(read_seconds(quoted).problem, HasSubstr("quotes"));
  YamlNode list;
  list.kind = YamlNode::Kind::kSequence;
  EXPECT_THAT(read_seconds(list).problem, HasSubstr("a list or a map"));
}

TEST(Numbers, IntegersAreWhole) {
  EXPECT_EQ(read_integer(plain("100")).value, 100);
  EXPECT_EQ(read_integer(plain("-7")).value, -7);
  EXPECT_EQ(read_integer(plain("+7")).value, 7);
  EXPECT_EQ(read_integer(plain("0")).value, 0);
  EXPECT_THAT(read_integer(plain("10.0")).problem, HasSubstr("not a whole number"));
  EXPECT_THAT(read_integer(plain("1e2")).problem, HasSubstr("not a whole number"));
  EXPECT_THAT(read_integer(plain("0x0a")).problem, HasSubstr("not a whole number"));
  EXPECT_THAT(read_integer(plain("+-7")).problem, HasSubstr("not a whole number"));
  EXPECT_THAT(read_integer(plain("07")).problem, HasSubstr("octal"));
  EXPECT_THAT(read_integer(plain("99999999999999999999")).problem, HasSubstr("too large"));
}

TEST(Numbers, SecondsAreWrittenAsPeopleDo) {
  EXPECT_EQ(in_seconds(500'000'000), "0.5 s");
  EXPECT_EQ(in_seconds(100'000'000), "0.1 s");
  EXPECT_EQ(in_seconds(0), "0 s");
  EXPECT_EQ(in_seconds(2'000'000'000), "2 s");
  EXPECT_EQ(in_seconds(-1'500'000'000), "-1.5 s");
  EXPECT_EQ(in_seconds(1), "0.000000001 s");
}

}  // namespace
}  // namespace arbiter::importing
