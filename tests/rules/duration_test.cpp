#include "rules/text/duration.hpp"

#include <gmock/gmock.h>

#include <string>
#include <utility>
#include <vector>

namespace arbiter::rules {
namespace {

using testing::HasSubstr;

TEST(Duration, IsAWholeNumberWithAUnit) {
  const std::vector<std::pair<std::string, shm::Nanoseconds>> cases{
      {"1ns", 1},
      {"250ns", 250},
      {"10us", 10'000},
      {"500ms", 500'000'000},
      {"0500ms", 500'000'000},
      {"2s", 2'000'000'000},
      {"forever", shm::kForever},
      {"2305843009213693951ns", shm::kMaxTime},
      {"2305843009s", 2'305'843'009'000'000'000},
  };
  for (const auto& [text, value] : cases) {
    const ParsedDuration parsed = parse_duration(text);
    EXPECT_EQ(parsed.problem, "") << text;
    EXPECT_EQ(parsed.value, value) << text;
  }
}

TEST(Duration, HasMinutesOnACommandLineOnly) {
  DurationWords words;
  words.takes_minutes = true;
  EXPECT_EQ(parse_duration("5min", words).value, 300'000'000'000);
  EXPECT_EQ(parse_duration("38430716min", words).value, 2'305'842'960'000'000'000);
  EXPECT_THAT(parse_duration("38430717min", words).problem, HasSubstr("longer than the limit"));
  EXPECT_THAT(parse_duration("0min", words).problem, HasSubstr("is zero"));
  EXPECT_THAT(parse_duration("1.5min", words).problem, HasSubstr("write 90s in its place"));
  EXPECT_THAT(parse_duration("5min").problem, HasSubstr("unknown unit; write 300s in its place"));
  EXPECT_THAT(parse_duration("38430717min").problem, HasSubstr("unknown unit; write a whole"));
}

TEST(Duration, ForeverIsRecognisedWhereItIsMisspelt) {
  for (const char* const text :
       {"Forever", "FOREVER", "for ever", "foreve", "inf", "Inf", "infinity", "never", "-1"}) {
    EXPECT_THAT(parse_duration(text).problem, HasSubstr("; did you mean \"forever\"?")) << text;
  }
  EXPECT_THAT(parse_duration("soon").problem, testing::Not(HasSubstr("did you mean")));
  for (const char* const text : {"forever", "Forever"}) {
    EXPECT_THAT(parse_duration(text, {.advice = "leave it out", .takes_forever = false}).problem,
                testing::EndsWith("is not a whole number with a unit; leave it out"))
        << text;
  }
}

TEST(Duration, OfAnotherUnitTheSameInOneOfOursIsTold) {
  const std::vector<std::pair<std::string, std::string>> cases{
      {"1h", "has an unknown unit; write 3600s in its place"},
      {"2sec", "has an unknown unit; write 2s in its place"},
      {"500MS", "has an unknown unit; write 500ms in its place"},
      {"10µs", "has an unknown unit; write 10us in its place"},
      {"500 ms", "has a blank; write 500ms in its place"},
      {"5 min", "has a blank; write 300s in its place"},
      {"0 ms", "has a blank; write the unit right behind the number"},
      {"5 parsecs", "has an unknown unit; write a whole number"},
      {"5 m", "has an unknown unit; write 300s for minutes, or 5ms for milliseconds"},
      {"5m", "has an unknown unit; write 300s for minutes, or 5ms for milliseconds"},
      {"5M", "has an unknown unit; write 300s for minutes, or 5ms for milliseconds"},
      {"0m", "has an unknown unit; write a whole number"},
      {"2305843009213693952h", "has an unknown unit; write a whole number"},
      {"0h", "has an unknown unit; write a whole number"},
  };
  for (const auto& [text, advice] : cases) {
    EXPECT_THAT(parse_duration(text).problem, HasSubstr(advice)) << text;
  }
  DurationWords words;
  words.takes_minutes = true;
  EXPECT_THAT(parse_duration("5m", words).problem,
              HasSubstr("write 5min for minutes, or 5ms for milliseconds"));
}

TEST(Duration, IsWrittenInTheLargestUnitWithoutAFraction) {
  EXPECT_EQ(to_string(shm::Nanoseconds{500'000'000}), "500ms");
  EXPECT_EQ(to_string(shm::Nanoseconds{2'000'000'000}), "2s");
  EXPECT_EQ(to_string(shm::Nanoseconds{1'500}), "1500ns");
  EXPECT_EQ(to_string(shm::Nanoseconds{7'000}), "7us");
  EXPECT_EQ(to_string(shm::kForever), "forever");
}

TEST(Duration, IsRefusedWithAReason) {
  const std::vector<std::pair<std::string, std::string>> cases{
      {"", "not a whole number"},
      {"ms", "not a whole number"},
      {"-5ms", "not a whole number"},
      {"+5ms", "not a whole number"},
      {"Forever", "not a whole number"},
      {"0x10ms", "unknown unit"},
      {"500", "no unit"},
      {"500 ms", "has a blank"},
      {"500MS", "unknown unit"},
      {"500min", "unknown unit"},
      {"1e3ms", "unknown unit"},
      {"1s500ms", "unknown unit"},
      {"0.5s", "fraction"},
      {".5s", "fraction"},
      {"1.5", "no unit"},
      {"1,5s", "fraction"},
      {"0s", "zero"},
      {"000ns", "zero"},
      {"2305843009213693952ns", "longer than the limit of 2305843009213693951ns"},
      {"2305843010s", "longer than the limit"},
      {"9223372036854775807ns", "longer than the limit"},
      {"9223372036854775808ns", "longer than the limit"},
      {"18446744073709551617ns", "longer than the limit"},
      {std::string(1000, '9') + "s", "longer than the limit"},
  };
  for (const auto& [text, reason] : cases) {
    EXPECT_THAT(parse_duration(text).problem, HasSubstr(reason)) << text;
    EXPECT_THAT(parse_duration(text).problem, HasSubstr("; ")) << "does not say what to do";
  }
}

TEST(Duration, OfAFractionTheWholeNumberIsTold) {
  const std::vector<std::pair<std::string, std::string>> cases{
      {"0.5s", "write 500ms in"},
      {".5s", "write 500ms in"},
      {"1,5s", "write 1500ms in"},
      {"0.25ms", "write 250us in"},
      {"0.000001s", "write 1us in"},
      {"2.0s", "write 2000ms in"},
      {"1.000000001s", "write 1000000001ns in"},
  };
  for (const auto& [text, advice] : cases) {
    EXPECT_THAT(parse_duration(text).problem, HasSubstr(advice)) << text;
  }
  for (const char* const text : {"0.5ns", "0.0000000001s", "0.5", "0.s", "0.5min", "0.0s",
                                 "999999999.5s1", "0.5.5s", "9999999999.5s"}) {
    EXPECT_THAT(parse_duration(text).problem, testing::Not(HasSubstr("in its place"))) << text;
  }
}

}  // namespace
}  // namespace arbiter::rules
