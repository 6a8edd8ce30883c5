// Search and Track on two hosts. What the page says of it is what the demo itself judges.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <signal.h>

#include <fstream>
#include <map>
#include <optional>
#include <set>
#include <string>

#include "tests/demo/demo.hpp"
#include "tests/demo/terminal_session.hpp"
#include "tests/gateway/dds/own_domain.hpp"
#include "tests/support/run_program.hpp"

namespace arbiter::test {
namespace {

using testing::HasSubstr;
using testing::IsEmpty;
using testing::Not;

std::vector<std::string> of_hosts(const Demo& demo, const std::vector<std::string>& arguments) {
  std::vector<std::string> command = demo.command(arguments);
  for (std::string& word : command) {
    if (word == ARBITER_PROGRAMS "/search-and-track-demo") word = ARBITER_PROGRAMS "/hosts-demo";
  }
  return command;
}

void expect_as_the_page_says(const Demo& demo, const ProgramResult& result) {
  EXPECT_EQ(result.exit_code, 0) << result.out << result.err;
  EXPECT_THAT(result.out, HasSubstr("While the cable was out"));
  EXPECT_THAT(result.out, Not(HasSubstr("\x1b")));
  EXPECT_THAT(demo.processes(), IsEmpty());
  EXPECT_THAT(demo.files_left(), IsEmpty());
}

TEST(TwoHosts, TheArmRestsWhileTheCableIsOut) {
  const Demo demo;
  const ProgramResult result = run_program(of_hosts(demo, {"--seconds", "20"}));
  if (result.err.find("no networks of their own") != std::string::npos) GTEST_SKIP() << result.err;
  EXPECT_THAT(result.err, IsEmpty());
  expect_as_the_page_says(demo, result);
}

TEST(TwoHosts, WithoutNetworksOfTheirOwnALinkIsStopped) {
  const Demo demo;
  const OwnDomain domain;
  const ProgramResult result = run_program(of_hosts(
      demo, {"--loopback", "--seconds", "20", "--domain", std::to_string(domain.number())}));
  EXPECT_THAT(result.err, HasSubstr("both use the loopback interface"));
  expect_as_the_page_says(demo, result);
}

class TwoHostsKilled : public ::testing::Test {
 protected:
  // The demo on the loopback interface, in so many seconds.
  void begin(const std::string& seconds) {
    session_.emplace(of_hosts(demo_, {"--lines", "--loopback", "--seconds", seconds, "--domain",
                                      std::to_string(domain_.number())}),
                     24, 100);
  }
  // Returns once the demo has written the one, and then the other.
  void await_lines(const std::string& first, const std::string& second) {
    session_->watch_until([&] {
      const std::string& written = session_->written();
      const auto at = written.find(first);
      return at != std::string::npos && written.find(second, at) != std::string::npos;
    });
  }
  void kill_all() const {
    for (const auto& [pid, program] : demo_.own()) {
      if (program != "hosts-demo") ::kill(pid, SIGKILL);
    }
  }
  void expect_all_to_come_back() {
    EXPECT_EQ(session_->watch_to_the_end(), 0) << session_->written();
    for (const char* const program :
         {"head: arbiterd", "head: arbiter-link", "head: object-detector", "body: arbiterd",
          "body: arbiter-link", "body: rest-arm", "body: arm-control"}) {
      EXPECT_THAT(session_->written(), HasSubstr(std::string(program) + " is dead"));
      EXPECT_THAT(session_->written(), HasSubstr(std::string(program) + " is there again"));
    }
    EXPECT_THAT(demo_.processes(), IsEmpty());
    EXPECT_THAT(demo_.files_left(), IsEmpty());
  }

 private:
  const Demo demo_{};
  const OwnDomain domain_;
  std::optional<TerminalSession> session_;
};

// Whatever is killed comes back, and the scene goes on.
TEST_F(TwoHostsKilled, AnyProcessMayBeKilled) {
  begin("30");
  await_lines("It is started again", "/Arm/pos:i  /Object/pos:o");
  kill_all();
  expect_all_to_come_back();
}

// When they come back, the scene's time has passed.
TEST_F(TwoHostsKilled, TheSceneWaitsForWhoIsKilledAtItsEnd) {
  begin("20");
  await_lines("The object is gone", "/Arm/pos:i  /RestArm/pos:o");
  kill_all();
  expect_all_to_come_back();
}

TEST(TwoHosts, ThePictureShowsWhoIsWhere) {
  const Demo demo;
  const OwnDomain domain;
  TerminalSession session(of_hosts(demo, {"--loopback", "--seconds", "20", "--domain",
                                          std::to_string(domain.number())}),
                          24, 80);
  session.watch_until([&] {
    return session.written().find("obeys /Object/pos:o") != std::string::npos &&
           session.written().find("pulled") != std::string::npos;
  });
  for (const char* const text : {"head", "body", "object-detector", "arm-control"}) {
    EXPECT_THAT(session.written(), HasSubstr(text));
  }
  session.send(SIGTERM);
  EXPECT_EQ(session.watch_to_the_end(), 128 + SIGTERM);
  EXPECT_THAT(demo.processes(), IsEmpty());
}

}  // namespace
}  // namespace arbiter::test
