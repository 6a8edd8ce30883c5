// Who commands, and in which order. Times are not looked at: the machine may be busy.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <sstream>
#include <string>
#include <vector>

#include "tests/demo/demo.hpp"
#include "tests/support/run_program.hpp"

namespace arbiter::test {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;
using testing::Not;

// From lines like "  4.0 s  /Gaze/pos:i  /Face/pos:o", up to the summary.
std::vector<std::string> winners_at(const std::string& port, const std::string& output) {
  std::vector<std::string> winners;
  std::istringstream lines(output);
  for (std::string line; std::getline(lines, line) && line != "Who commanded:";) {
    std::istringstream words(line);
    std::string seconds, unit, destination, winner;
    if (words >> seconds >> unit >> destination >> winner && destination == port) {
      winners.push_back(winner);
    }
  }
  return winners;
}

TEST(SearchAndTrack, HasTheWinnersOfThePaperInTheirOrder) {
  const Demo demo;
  const ProgramResult result = run_program(demo.command({"--seconds", "10"}));
  EXPECT_THAT(winners_at("/Gaze/pos:i", result.out),
              ElementsAre("/RandomLook/pos:o", "/Face/pos:o", "/Object/pos:o", "idle",
                          "/Object/pos:o", "/Face/pos:o", "/RandomLook/pos:o"));
  EXPECT_THAT(
      winners_at("/Arm/pos:i", result.out),
      ElementsAre("/RestArm/pos:o", "/Object/pos:o", "idle", "/Object/pos:o", "/RestArm/pos:o"));
  EXPECT_EQ(result.exit_code, 0) << result.out << result.err;
  EXPECT_THAT(result.out, HasSubstr("These are the winners that the paper's model demands"));
  EXPECT_THAT(result.out, Not(HasSubstr("\x1b")));
  EXPECT_THAT(result.err, IsEmpty());
  EXPECT_THAT(demo.processes(), IsEmpty());
  EXPECT_THAT(demo.files_left(), IsEmpty());
}

TEST(HandOver, IsAnotherApplicationOfTheSameComponents) {
  const Demo demo;
  const ProgramResult result =
      run_program(demo.command({"--seconds", "10", "--model", SEARCH_AND_TRACK "/hand_over.xml"}));
  EXPECT_THAT(winners_at("/Gaze/pos:i", result.out),
              ElementsAre("/RandomLook/pos:o", "/Face/pos:o", "/RandomLook/pos:o"));
  EXPECT_THAT(
      winners_at("/Arm/pos:i", result.out),
      ElementsAre("/RestArm/pos:o", "/Object/pos:o", "idle", "/Object/pos:o", "/RestArm/pos:o"));
  EXPECT_EQ(result.exit_code, 0) << result.out << result.err;
}

}  // namespace
}  // namespace arbiter::test
