// Programs that are started without some of the three standard streams.
#include <gtest/gtest.h>

#include <string>

#include "tests/cli/arbiter_program.hpp"
#include "tests/support/daemon.hpp"

namespace arbiter::test {
namespace {

ProgramResult without_streams(const std::string& closed, const std::string& program,
                              const std::string& arguments) {
  return run_program({"/bin/sh", "-c", "exec \"$0\" " + arguments + " " + closed,
                      std::string(ARBITER_PROGRAMS) + "/" + program});
}

// The first file that it opened would be its standard error, and what it says would be written
// there.
TEST(ClosedStreams, LeaveARecordingWhole) {
  Daemon daemon("<behaviors><arbiter at='/p'><select from='/s'/></arbiter></behaviors>");
  int number = 0;
  for (const std::string closed :
       {"2>&-", "0<&- 2>&-", "1>&- 2>&-", "0<&- 1>&-", "0<&- 1>&- 2>&-"}) {
    const std::string file = daemon.directory() + "/" + std::to_string(++number) + ".mcap";
    const auto recorded =
        without_streams(closed, "arbiter", "record --duration 50ms -o '" + file + "'");
    EXPECT_EQ(recorded.exit_code, 0) << closed;
    const auto info = arbiter({"recording", "info", file});
    EXPECT_EQ(info.exit_code, 0) << closed << ": " << info.out << info.err;
  }
}

TEST(ClosedStreams, DoNotKeepADaemonFromItsWork) {
  const auto result = without_streams("0<&- 1>&- 2>&-", "arbiterd", "--check");
  EXPECT_EQ(result.exit_code, 0);
}

}  // namespace
}  // namespace arbiter::test
