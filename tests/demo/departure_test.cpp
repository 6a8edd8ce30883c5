// However the demo ends, nothing of it stays: no process, no file.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <string>
#include <thread>
#include <vector>

#include "tests/demo/demo.hpp"
#include "tests/demo/terminal_session.hpp"
#include "tests/support/run_program.hpp"

namespace arbiter::test {
namespace {

using testing::ElementsAreArray;
using testing::HasSubstr;
using testing::IsEmpty;
using testing::SizeIs;

const std::vector<std::string> kProcesses{"arbiterd",      "arm-control",  "collision-detector",
                                          "face-detector", "gaze-control", "object-detector",
                                          "random-look",   "rest-arm",     "search-and-track-demo"};

// Runs until all processes are there. Both ports may have a winner before the last one is what it
// is to be.
class RunningDemo {
 public:
  RunningDemo() : session_(demo_.command({"--lines"}), 24, 80) {
    session_.watch_until([&] {
      return session_.written().find("/RandomLook/pos:o") != std::string::npos &&
             session_.written().find("/RestArm/pos:o") != std::string::npos;
    });
    while (demo_.processes() != kProcesses) std::this_thread::yield();
  }
  [[nodiscard]] const Demo& demo() const { return demo_; }
  TerminalSession& session() { return session_; }

 private:
  Demo demo_;
  TerminalSession session_;
};

TEST(Departure, LeavesNothingBehindWhenTerminated) {
  RunningDemo running;
  EXPECT_THAT(running.demo().processes(), ElementsAreArray(kProcesses));
  running.session().send(SIGTERM);
  EXPECT_EQ(running.session().watch_to_the_end(), 128 + SIGTERM);
  EXPECT_THAT(running.demo().processes(), IsEmpty());
  EXPECT_THAT(running.demo().files_left(), IsEmpty());
}

TEST(Departure, LeavesNoProcessBehindWhenKilled) {
  RunningDemo running;
  EXPECT_THAT(running.demo().processes(), SizeIs(9));
  running.session().send(SIGKILL);
  EXPECT_EQ(running.session().watch_to_the_end(), 128 + SIGKILL);
  EXPECT_THAT(running.demo().processes_after_a_while(), IsEmpty());
}

TEST(Departure, SaysWhatIsWrongWithABadModel) {
  const Demo demo;
  const TemporaryDirectory directory;
  const std::string model = directory.write("bad.xml", "<behaviors><behaviour/></behaviors>");
  const ProgramResult result = run_program(demo.command({"--model", model}));
  EXPECT_EQ(result.exit_code, 1);
  EXPECT_THAT(result.err, HasSubstr("arbiterd ended with exit code"));
  EXPECT_THAT(result.err, HasSubstr("bad.xml:1"));
  EXPECT_THAT(demo.processes(), IsEmpty());
  EXPECT_THAT(demo.files_left(), IsEmpty());
}

}  // namespace
}  // namespace arbiter::test
