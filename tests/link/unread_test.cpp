// A link whose standard error nobody reads.
#include <gtest/gtest.h>
#include <signal.h>

#include <string>
#include <vector>

#include "tests/link/robot.hpp"
#include "tests/support/full_pipe.hpp"

namespace arbiter::test {
namespace {

class UnreadLinks : public LoopbackHosts {
 protected:
  // In place of the host's link.
  void start_unread(Host& host, const std::string& name) {
    host.link().kill();
    std::vector<std::string> arguments = {std::string(ARBITER_PROGRAMS) + "/arbiter-link",
                                          "--instance", name, "--host", name};
    for (const std::string& each : network()) arguments.push_back(each);
    host.link() =
        ChildProcess(arguments, {{"CYCLONEDDS_URI", std::nullopt}}, {-1, -1, unread_.write_end()});
  }

  const FullPipe unread_;
};

TEST_F(UnreadLinks, PassWhatTheyAreGivenAndEndWhenTheyAreAskedTo) {
  Host head("head", runtime_, source_model("300ms"), network());
  Host base("base", runtime_, motor_model("300ms"), network());
  start_unread(head, "head");
  start_unread(base, "base");
  Planner planner(head);
  Body body(base);
  body.drive(planner);
  head.link().signal(SIGTERM);
  EXPECT_EQ(head.link().wait(), 0);
  body.fall_back();
  base.link().signal(SIGTERM);
  EXPECT_EQ(base.link().wait(), 0);
}

}  // namespace
}  // namespace arbiter::test
