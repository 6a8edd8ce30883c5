// arbiter graph --live, with a real daemon.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sched.h>

#include <filesystem>

#include <arbiter/arbiter.hpp>
#include <nlohmann/json.hpp>

#include "tests/cli/arbiter_program.hpp"
#include "tests/support/daemon.hpp"
#include "tests/support/text_files.hpp"

namespace arbiter::test {
namespace {

using testing::HasSubstr;
using testing::Not;

const std::string kLowAndHigh = R"(<behaviors timeout="3600s">
  <behavior name="Low"><config at="/p">/low</config><condition>not /stop</condition></behavior>
  <behavior name="High"><config at="/p">/high</config><inhibition>Low</inhibition></behavior>
</behaviors>
)";

std::string live(const std::string& view) {
  const auto result = arbiter({"graph", "--live", "--format", "dot", "--view", view});
  EXPECT_EQ(result.exit_code, 0) << result.err;
  EXPECT_EQ(result.err, "");
  return result.out;
}

TEST(LiveGraph, ShowsWhoRunsAndWhoIsOverridden) {
  Daemon daemon(kLowAndHigh);
  Node node("test");
  auto low = node.output_port<int>("/low");
  auto high = node.output_port<int>("/high");
  EXPECT_THAT(live("behaviours"), HasSubstr("○ Low"));
  low.signal();
  EXPECT_THAT(live("behaviours"), HasSubstr("▶ Low"));
  EXPECT_THAT(live("behaviours"), HasSubstr("○ High"));
  high.signal();
  EXPECT_THAT(live("behaviours"), HasSubstr("✕ Low"));
  EXPECT_THAT(live("behaviours"), HasSubstr("▶ High"));
}

TEST(LiveGraph, SaysWhichModelOfWhichInstanceItIsOf) {
  Daemon daemon(kLowAndHigh);
  EXPECT_THAT(live("behaviours"), HasSubstr("model 1 ("));
  EXPECT_THAT(live("behaviours"), HasSubstr(" in force, instance "));
  daemon.load(kLowAndHigh + "<!-- the same again -->");
  EXPECT_THAT(live("behaviours"), HasSubstr("model 2 ("));
}

TEST(LiveGraph, DrawsOnePortOfMany) {
  Daemon daemon(R"(<behaviors timeout="3600s">
    <behavior name="One"><config at="/p">/one</config></behavior>
    <behavior name="Two"><config at="/q">/two</config></behavior></behaviors>)");
  Node node("test");
  auto one = node.output_port<int>("/one");
  auto two = node.output_port<int>("/two");
  one.signal();
  two.signal();
  const auto result = arbiter({"graph", "--live", "--format", "dot", "--port", "/p"});
  EXPECT_EQ(result.exit_code, 0) << result.err;
  EXPECT_THAT(result.out, HasSubstr("▶ One"));
  EXPECT_THAT(result.out, Not(HasSubstr("Two")));
}

TEST(LiveGraph, ShowsActiveSourcesAndTheWinningRule) {
  Daemon daemon(kLowAndHigh);
  Node node("test");
  auto low = node.output_port<int>("/low");
  auto stop = node.output_port<int>("/stop");
  low.signal();
  std::string now = live("connections");
  EXPECT_THAT(now, HasSubstr("▶ /low ∧ ¬/stop"));
  EXPECT_THAT(now, HasSubstr("● /low"));
  EXPECT_THAT(now, HasSubstr("○ /stop"));
  stop.signal();
  now = live("connections");
  EXPECT_THAT(now, HasSubstr("✕ /low ∧ ¬/stop"));
  EXPECT_THAT(now, HasSubstr("● /stop"));
  EXPECT_THAT(now, Not(HasSubstr("▶ /")));
}

// Nobody is active: who wins tells nothing.
TEST(LiveGraph, TellsOfADaemonThatHasAnotherModel) {
  Daemon daemon(kLowAndHigh);
  const TemporaryDirectory directory;
  const auto other = directory.write("other.xml", R"(<behaviors>
    <behavior name="Low"><config at="/p">/low</config><condition>/stop</condition></behavior>
  </behaviors>)");
  const auto result = arbiter({"graph", other, "--live", "--format", "dot"});
  EXPECT_EQ(result.exit_code, 1);
  EXPECT_THAT(result.err, HasSubstr("not the text of the model in force, model 1"));
  const auto same =
      arbiter({"graph", directory.write("same.xml", kLowAndHigh), "--live", "--format", "dot"});
  EXPECT_EQ(same.exit_code, 0);
  EXPECT_EQ(same.err, "");
}

// The file may be another one by now.
TEST(LiveGraph, DrawsTheTextThatTheDaemonHasRead) {
  Daemon daemon(kLowAndHigh);
  daemon.write_model("<behaviors><behavior name=\"Other\"/></behaviors>");
  EXPECT_THAT(live("behaviours"), HasSubstr("○ Low"));
}

// Reads the picture again and again until somebody has written what it waits for.
void wait_for_picture(const std::string& path, const std::string& text) {
  for (;;) {
    if (std::filesystem::exists(path)) {
      const std::string content = content_of(path);
      ASSERT_TRUE(content.starts_with("digraph") && content.ends_with("}\n"))
          << "half a picture: " << content;
      if (content.find(text) != std::string::npos) return;
    }
    sched_yield();
  }
}

TEST(LiveGraph, FollowsEachChangeUntilItIsInterrupted) {
  Daemon daemon(kLowAndHigh);
  Node node("test");
  auto low = node.output_port<int>("/low");
  auto high = node.output_port<int>("/high");
  const TemporaryDirectory directory;
  const auto path = directory.path() + "/now.dot";
  ChildProcess follower({ARBITER_PROGRAMS "/arbiter", "graph", "--follow", "-o", path}, {}, {});
  wait_for_picture(path, "○ Low");
  low.signal();
  wait_for_picture(path, "▶ Low");
  high.signal();
  wait_for_picture(path, "✕ Low");
  high.deactivate();
  wait_for_picture(path, "▶ Low");
  daemon.load_bad("<behaviors>");
  low.deactivate();
  wait_for_picture(path, "○ Low");
  daemon.load(R"(<behaviors timeout="3600s">
    <behavior name="Only"><config at="/p">/high</config></behavior></behaviors>)");
  wait_for_picture(path, "○ Only");
  high.signal();
  wait_for_picture(path, "▶ Only");
  follower.signal(SIGINT);
  EXPECT_EQ(follower.wait(), 0);
}

// Returns once somebody has written the text to the pipe.
void read_until(const shm::FileDescriptor& pipe, const std::string& text) {
  std::string said;
  while (said.find(text) == std::string::npos) {
    char part[512];
    const ssize_t count = ::read(pipe.get(), part, sizeof part);
    ASSERT_GT(count, 0) << said;
    said.append(part, static_cast<std::size_t>(count));
  }
}

// `err`: where what it says can be read.
ChildProcess follow(const std::string& path, shm::FileDescriptor& err,
                    const std::vector<std::string>& more = {}) {
  int ends[2];
  if (::pipe2(ends, O_CLOEXEC) != 0) throw std::runtime_error("pipe2");
  err.reset(ends[0]);
  const shm::FileDescriptor their_err(ends[1]);
  std::vector<std::string> verb{ARBITER_PROGRAMS "/arbiter", "graph", "--follow", "-o", path};
  verb.insert(verb.end(), more.begin(), more.end());
  return ChildProcess(verb, {}, {-1, -1, their_err.get()});
}

// It has asked the daemon before it draws, and has given up.
TEST(LiveGraph, FollowsEachChangeWhileTheDaemonIsStopped) {
  Daemon daemon(kLowAndHigh);
  Node node("test");
  auto low = node.output_port<int>("/low");
  auto high = node.output_port<int>("/high");
  const TemporaryDirectory directory;
  const auto path = directory.path() + "/now.dot";
  shm::FileDescriptor err;
  ChildProcess follower = follow(path, err);
  wait_for_picture(path, "○ Low");
  daemon.process().stop();
  read_until(err, "has not answered in time");
  low.signal();
  wait_for_picture(path, "▶ Low");
  high.signal();
  wait_for_picture(path, "✕ Low");
  daemon.process().resume();
  high.deactivate();
  wait_for_picture(path, "▶ Low");
  follower.signal(SIGINT);
  EXPECT_EQ(follower.wait(), 0);
}

TEST(LiveGraph, SaysThatTheDaemonHasGoneAndFollowsTheNext) {
  Daemon daemon(kLowAndHigh);
  const TemporaryDirectory directory;
  const auto path = directory.path() + "/now.dot";
  shm::FileDescriptor err;
  ChildProcess follower = follow(path, err);
  wait_for_picture(path, "○ Low");
  daemon.terminate();
  read_until(err, "the daemon has gone");
  daemon.write_model(R"(<behaviors timeout="3600s">
    <behavior name="Next"><config at="/p">/high</config></behavior></behaviors>)");
  daemon.restart();
  wait_for_picture(path, "○ Next");
  follower.signal(SIGINT);
  EXPECT_EQ(follower.wait(), 0);
}

TEST(LiveGraph, KeepsThePictureOfAPortThatAModelLacks) {
  Daemon daemon(kLowAndHigh);
  const TemporaryDirectory directory;
  const auto path = directory.path() + "/now.dot";
  shm::FileDescriptor err;
  ChildProcess follower = follow(path, err, {"--port", "/p"});
  wait_for_picture(path, "○ Low");
  daemon.load(R"(<behaviors><behavior name="Other"><config at="/q">/low</config></behavior>
    </behaviors>)");
  read_until(err, "the model has no input port /p");
  daemon.load(R"(<behaviors timeout="3600s">
    <behavior name="Again"><config at="/p">/low</config></behavior></behaviors>)");
  wait_for_picture(path, "○ Again");
  follower.signal(SIGINT);
  EXPECT_EQ(follower.wait(), 0);
}

}  // namespace
}  // namespace arbiter::test
