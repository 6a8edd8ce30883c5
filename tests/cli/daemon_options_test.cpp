// What arbiterd says of values that its options do not take: in the words of all programs.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <string>
#include <vector>

#include "tests/support/run_program.hpp"

namespace arbiter::test {
namespace {

using testing::AllOf;
using testing::HasSubstr;
using testing::Not;

ProgramResult arbiterd(std::vector<std::string> arguments) {
  arguments.insert(arguments.begin(), ARBITER_PROGRAMS "/arbiterd");
  return run_program(arguments);
}

TEST(DaemonOptions, AreRefusedInWords) {
  const auto error = [](const std::vector<std::string>& arguments) {
    const auto result = arbiterd(arguments);
    EXPECT_EQ(result.exit_code, 2) << arguments.front();
    return result.err.substr(0, result.err.find('\n'));
  };
  for (const std::string effort : {"0", "nan", "x"}) {
    EXPECT_EQ(error({"--effort", effort}),
              "--effort: \"" + effort + "\" is not a number from 0.001 to 1000");
  }
  EXPECT_EQ(error({"--log-level", "foo"}),
            "--log-level: \"foo\" is not trace, debug, info, warn or error");
  EXPECT_EQ(error({"--user-share", "100"}),
            "--user-share: \"100\" is not a whole number from 1 to 99");
  // Without a policy everybody may open ports.
  EXPECT_EQ(error({"--check", "--policy", ""}), "--policy: is empty; write FILE, or leave it out");
}

TEST(DaemonOptions, HaveWordsForTheirValuesInTheHelp) {
  EXPECT_THAT(arbiterd({"--help"}).out,
              AllOf(HasSubstr("--effort FACTOR "), HasSubstr("--user-share PERCENT "),
                    HasSubstr("(default 50)"), HasSubstr("--log-level LEVEL "),
                    Not(HasSubstr(" in [")), Not(HasSubstr(":UINT"))));
}

}  // namespace
}  // namespace arbiter::test
