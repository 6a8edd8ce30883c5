// What arbiter top does to a terminal: which ones it takes, and how it leaves them.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <signal.h>

#include <arbiter/arbiter.hpp>

#include "tests/cli/arbiter_program.hpp"
#include "tests/support/child_process.hpp"
#include "tests/support/daemon.hpp"
#include "tests/top/top_program.hpp"

namespace arbiter::test {
namespace {

using testing::HasSubstr;
using testing::Not;

class TopTerminal : public testing::Test {
 protected:
  static EmulatedTerminal::Size size() { return {24, 80}; }

  Daemon daemon_{kTopModel};
};

TEST_F(TopTerminal, IsGivenBackHoweverItEnds) {
  const std::vector<std::pair<std::string, int>> ends = {{"q", 0}, {"\x03", 0}, {"\x1c", 0}};
  for (const auto& [keys, code] : ends) {
    EmulatedTerminal top({kArbiter, "top"}, top_environment(), size());
    ASSERT_TRUE(top.wait_for("INPUT PORT")) << top.text();
    EXPECT_FALSE(top.is_restored());
    top.type(keys);
    EXPECT_EQ(top.wait_for_end(), code);
    EXPECT_TRUE(top.is_restored());
  }
  for (const int signal : {SIGINT, SIGTERM, SIGQUIT, SIGUSR1, SIGUSR2, SIGALRM, SIGIO, SIGRTMIN}) {
    EmulatedTerminal top({kArbiter, "top"}, top_environment(), size());
    ASSERT_TRUE(top.wait_for("INPUT PORT")) << top.text();
    top.send(signal);
    EXPECT_EQ(top.wait_for_end(), 0) << signal;
    EXPECT_TRUE(top.is_restored()) << signal;
  }
}

TEST_F(TopTerminal, IsKeptAtASignalThatIsIgnored) {
  const std::string ignoring = "trap '' QUIT USR1; exec " + kArbiter + " top";
  EmulatedTerminal top({"/bin/bash", "-c", ignoring}, top_environment(), size());
  ASSERT_TRUE(top.wait_for("INPUT PORT")) << top.text();
  top.send(SIGQUIT);
  top.send(SIGUSR1);
  top.type("?");
  EXPECT_TRUE(top.wait_for("Ctrl-L")) << top.text();
  top.send(SIGINT);
  EXPECT_EQ(top.wait_for_end(), 0);
}

// By a shell, for a program that nobody could wake again is not stopped by Ctrl-Z.
TEST_F(TopTerminal, IsGivenBackWhileItIsStopped) {
  const std::string jobs =
      "set -m; " + kArbiter + " top; echo has stopped; read; fg; echo has ended";
  EmulatedTerminal top({"/bin/bash", "-c", jobs}, top_environment(), size());
  ASSERT_TRUE(top.wait_for("INPUT PORT")) << top.text();
  top.type("\x1a");
  ASSERT_TRUE(top.wait_for("has stopped")) << top.text();
  EXPECT_TRUE(top.is_restored());
  top.type("\r");
  ASSERT_TRUE(top.wait_until([&] { return top.is_alternate() && top.shows("INPUT PORT"); }))
      << top.text();
  EXPECT_FALSE(top.is_restored());
  top.type("q");
  EXPECT_EQ(top.wait_for_end(), 0);
  EXPECT_TRUE(top.shows("has ended")) << top.text();
  EXPECT_TRUE(top.is_restored());
}

TEST_F(TopTerminal, HasColoursOnlyWhereItWantsThem) {
  const std::vector<std::pair<Environment, bool>> cases = {{{}, true},
                                                           {{{"NO_COLOR", "1"}}, false},
                                                           {{{"NO_COLOR", ""}}, true},
                                                           {{{"TERM", "vt100"}}, false},
                                                           {{{"TERM", "xterm-mono"}}, false}};
  for (const auto& [changes, is_coloured] : cases) {
    EmulatedTerminal top({kArbiter, "top"}, top_environment(changes), size());
    ASSERT_TRUE(top.wait_for("/low:o")) << top.text();
    ASSERT_TRUE(top.wait_for("q quit")) << top.text();
    EXPECT_EQ(top.is_coloured(), is_coloured) << top.text();
    EXPECT_GE(top.row_with(">/p:i"), 1) << top.text();  // the cursor is seen without it
  }
}

TEST_F(TopTerminal, ShowsAsciiWhereTheLocaleIsNoUtf8) {
  EmulatedTerminal top({kArbiter, "top"}, top_environment({{"LC_ALL", "C"}}), size());
  Node node("robot");
  auto low = node.output_port<int>("/low:o");
  auto high = node.output_port<int>("/腕:o");
  low.publish(1);
  ASSERT_TRUE(top.wait_for("##########")) << top.text();
  ASSERT_TRUE(top.wait_for("/\\xe8\\x85\\x95:o")) << top.text();
  for (const char each : top.written()) ASSERT_GE(each, 0);
}

TEST_F(TopTerminal, ShowsWideCharactersInTheirColumns) {
  Node node("robot");
  auto wide = node.output_port<int>("/腕:o");
  EmulatedTerminal top({kArbiter, "top"}, top_environment(), size());
  ASSERT_TRUE(top.wait_for("/腕:o")) << top.text();
  // Two rows whose columns stand below each other, whatever their names.
  const auto column_of = [&](const std::string& name) {
    const std::string row = top.row(top.row_with(name));
    return row.find("never") - (name.find("腕") != std::string::npos ? 1 : 0);  // 3 bytes for 2
  };
  EXPECT_EQ(column_of(" /腕:o"), column_of(" /low:o")) << top.text();
}

TEST_F(TopTerminal, MayBeOneWhoseDescriptionHasNoSize) {
  const EmulatedTerminal::Size sizes[] = {{24, 80}, {40, 100}, {8, 30}, {400, 700}};
  for (const auto& its : sizes) {
    EmulatedTerminal top({kArbiter, "top"}, top_environment({{"TERM", "linux"}}), its);
    ASSERT_TRUE(top.wait_for("INPUT PORT")) << top.text();
    ASSERT_TRUE(top.wait_for("q quit")) << top.text();
    top.type("q");
    EXPECT_EQ(top.wait_for_end(), 0);
  }
}

TEST(TopTerminalOf, SendsNothingThatANameSays) {
  TemporaryDirectory directory;
  const std::string model = directory.write("evil\x1b]0;mine\x07.xml", kTopModel);
  Daemon::Options options;
  options.without_model = true;
  options.arguments = {"--model", model};
  Daemon daemon("", options);
  EmulatedTerminal top({kArbiter, "top"}, top_environment(), {24, 160});
  ASSERT_TRUE(top.wait_for("INPUT PORT")) << top.text();
  top.type("\r");
  ASSERT_TRUE(top.wait_for("evil\\x1b]0;mine\\x07.xml")) << top.text();
  EXPECT_THAT(top.written(), Not(HasSubstr("\x1b]0;mine")));
}

TEST_F(TopTerminal, MustBeATerminalThatCanMoveItsCursor) {
  const auto piped = arbiter({"top"});
  EXPECT_EQ(piped.exit_code, 2);
  EXPECT_EQ(piped.out, "");
  EXPECT_THAT(piped.err, HasSubstr("not a terminal"));
  EXPECT_THAT(piped.err, HasSubstr("--once"));
  for (const auto* const name : {"dumb", "no-such-terminal", ""}) {
    EmulatedTerminal top({kArbiter, "top"}, top_environment({{"TERM", name}}), size());
    EXPECT_EQ(top.wait_for_end(), 2);
    EXPECT_THAT(top.written(), HasSubstr("--once"));
    EXPECT_TRUE(top.is_restored());
  }
}

TEST_F(TopTerminal, IsNotTakenWhereThereIsNoDaemon) {
  daemon_.terminate();
  EmulatedTerminal top({kArbiter, "top"}, top_environment(), size());
  EXPECT_EQ(top.wait_for_end(), 1);
  EXPECT_TRUE(top.shows("arbiter: no arbiterd")) << top.text();
  EXPECT_EQ(top.written().find("\x1b[?1049h"), std::string::npos);
}

// The signal waits for `top`, which has not been started yet.
TEST_F(TopTerminal, OfOnePictureThatIsNotDrawnSaysTheSignal) {
  sigset_t interrupt;
  sigset_t before;
  sigemptyset(&interrupt);
  sigaddset(&interrupt, SIGINT);
  pthread_sigmask(SIG_BLOCK, &interrupt, &before);
  ChildProcess top({kArbiter, "top", "--once"}, {}, {});
  pthread_sigmask(SIG_SETMASK, &before, nullptr);
  top.signal(SIGINT);
  EXPECT_EQ(top.wait(), 128 + SIGINT);
}

TEST_F(TopTerminal, IsNotNeededForOnePicture) {
  Node node("robot");
  auto in = node.input_port<int>("/p:i");
  auto low = node.output_port<int>("/low:o");
  low.publish(1);
  const auto once = arbiter({"top", "--once"});
  EXPECT_EQ(once.exit_code, 0) << once.err;
  EXPECT_THAT(once.out, HasSubstr("instance test, model 1"));
  EXPECT_THAT(once.out, testing::ContainsRegex("/p:i +/low:o .* 1/8 robot"));
  EXPECT_THAT(once.out, Not(HasSubstr("\x1b")));
  daemon_.terminate();
  EXPECT_EQ(arbiter({"top", "--once"}).exit_code, 1);
  EXPECT_EQ(arbiter({"top", "--interval", "1ms"}).exit_code, 2);
}

}  // namespace
}  // namespace arbiter::test
