// arbiter wait, as scripts use it.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <arbiter/arbiter.hpp>
#include <nlohmann/json.hpp>

#include "tests/cli/why_program.hpp"
#include "tests/support/daemon.hpp"
#include "tests/support/text_files.hpp"

namespace arbiter::test {
namespace {

using nlohmann::json;
using testing::AllOf;
using testing::HasSubstr;

constexpr int kTimedOut = 3;

ProgramResult wait_until(const std::string& condition, std::vector<std::string> more = {}) {
  more.insert(more.begin(), {"wait", "--until", condition});
  return arbiter(more);
}

// One that waits beside the test, and has said `first`.
class Waiting {
 public:
  struct How {
    std::vector<std::string> more{};  // arguments
    std::string first{kHasLooked};
    std::vector<std::string> by{};  // a program that is given the command line to execute
  };

  Waiting(const Daemon& daemon, const std::string& condition) : Waiting(daemon, condition, How()) {}
  Waiting(const Daemon& daemon, const std::string& condition, const How& how)
      : err_(daemon.directory() + "/wait.err") {
    const shm::FileDescriptor err(
        ::open(err_.c_str(), O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC, 0600));
    // It warns of the pattern once it knows the names.
    std::vector<std::string> argv = how.by;
    argv.insert(argv.end(), {std::string(ARBITER_PROGRAMS) + "/arbiter", "wait", "--until",
                             condition + " and none(/no-such-source*)"});
    argv.insert(argv.end(), how.more.begin(), how.more.end());
    process_ = ChildProcess(argv, {}, {-1, -1, err.get()});
    see(how.first);
  }
  void signal(int number) const { process_.signal(number); }
  [[nodiscard]] bool has_ended() const {
    pollfd ended{process_.descriptor(), POLLIN, 0};
    return ::poll(&ended, 1, 0) == 1;
  }
  int exit_code() { return process_.wait(); }
  [[nodiscard]] std::string error() const { return content_of(err_); }
  // Returns once it has said so.
  void see(const std::string& text) const {
    pollfd ended{process_.descriptor(), POLLIN, 0};
    while (error().find(text) == std::string::npos) {
      if (::poll(&ended, 1, 1) != 1 || error().find(text) != std::string::npos) continue;
      throw std::runtime_error("it has ended: " + error());
    }
  }

  static constexpr const char* kHasLooked = "matches-nothing";

 private:
  const std::string err_;
  ChildProcess process_;
};

TEST(Wait, ReturnsWhenTheConditionBecomesTrue) {
  Daemon daemon(kGazeModel);
  Node node("test");
  auto face = node.output_port<int>("/face");
  auto object = node.output_port<int>("/object");
  Waiting waiting(daemon, "winner(/gaze) = /object and /face");
  face.signal();
  object.signal();
  EXPECT_EQ(waiting.exit_code(), 0);
}

TEST(Wait, SeesActivityEnd) {
  Daemon daemon(
      "<behaviors timeout='60ms'><arbiter at='/p'><select from='/a'/></arbiter></behaviors>");
  Node node("test");
  auto a = node.output_port<int>("/a");
  a.signal();
  const auto result = wait_until("idle(/p)", {"--json"});
  EXPECT_EQ(result.exit_code, 0) << result.err;
  const json answer = json::parse(result.out);
  EXPECT_EQ(answer["winners"], (json{{"/p", nullptr}}));
  EXPECT_EQ(answer["fulfilled"], true);
}

TEST(Wait, SaysWhatWasSoWhenItGaveUp) {
  Daemon daemon(kGazeModel);
  Node node("test");
  auto face = node.output_port<int>("/face");
  face.signal();
  const auto result =
      wait_until("winner(/gaze) = /object or idle(/gaze) and not /face", {"--timeout", "0s"});
  EXPECT_EQ(result.exit_code, kTimedOut);
  EXPECT_EQ(result.out, "");
  EXPECT_EQ(result.err,
            "arbiter: timed out after 0.000 s: \"winner(/gaze) = /object or idle(/gaze) and not "
            "/face\" does not hold\n"
            "  /face wins at /gaze  (arbiter why /gaze)\n"
            "  /face is active\n");
}

TEST(Wait, AnswersAsJson) {
  Daemon daemon(kGazeModel);
  const auto result =
      wait_until("not any(/*)  and idle(/gaze)", {"--json", "--timeout", "forever"});
  EXPECT_EQ(result.exit_code, 0);
  json answer = json::parse(result.out);
  EXPECT_GT(answer["at_ns"], 0);
  EXPECT_GE(answer["waited_ns"], 0);
  answer.erase("at_ns");
  answer.erase("waited_ns");
  EXPECT_EQ(
      answer,
      (json{{"condition", "not any(/*) and idle(/gaze)"},
            {"fulfilled", true},
            {"holds", true},
            {"model", 1},
            {"winners", {{"/gaze", nullptr}}},
            {"active",
             {{"/collision", false}, {"/face", false}, {"/object", false}, {"/random", false}}}}));
}

TEST(Wait, ForATimeCountsFromWhenTheConditionBecameTrue) {
  Daemon daemon(kGazeModel);
  auto result = wait_until("idle(/gaze)", {"--for", "40ms", "--json"});
  EXPECT_EQ(result.exit_code, 0);
  EXPECT_GE(json::parse(result.out)["waited_ns"], 40'000'000);
  Node node("test");
  auto face = node.output_port<int>("/face");
  for (std::string said;
       said.find("holds, but has not done so for 0.020 s") == std::string::npos;) {
    Waiting waiting(daemon, "/face", {.more = {"--for", "20ms", "--timeout", "20ms"}});
    while (!waiting.has_ended()) {  // which the last look may find either way
      face.signal();
      face.deactivate();
    }
    waiting.exit_code();
    said = waiting.error();
  }
}

TEST(Wait, ForATimeThatIsLongerThanItsTimeoutIsRefused) {
  const auto result = wait_until("/face", {"--for", "3s", "--timeout", "1s"});
  EXPECT_EQ(result.exit_code, 2);
  EXPECT_THAT(result.err,
              HasSubstr("--for 3s is longer than --timeout 1s, so it could never be true\n"));
}

// A shell that starts it with `&` in a script has it ignore SIGINT.
TEST(Wait, IsStoppedBySigintThoughItWasStartedToIgnoreIt) {
  Daemon daemon(kGazeModel);
  Waiting waiting(daemon, "/face", {.by = {"/bin/sh", "-c", "trap '' INT; exec \"$@\"", "sh"}});
  waiting.signal(SIGINT);
  waiting.signal(SIGTERM);  // of both, the first in number is read first
  EXPECT_EQ(waiting.exit_code(), 128 + SIGINT);
}

TEST(Wait, WithATimeoutWaitsForADaemonAsWell) {
  Daemon daemon(kGazeModel);
  daemon.kill();
  const Waiting::How how{.more = {"--timeout", "3600s"}, .first = "answers yet; waiting for one"};
  {
    Waiting waiting(daemon, "/face", how);
    waiting.signal(SIGTERM);
    EXPECT_EQ(waiting.exit_code(), 128 + SIGTERM);
  }
  Waiting waiting(daemon, "/face", how);
  daemon.restart();
  waiting.see(Waiting::kHasLooked);
  Node node("test");
  auto face = node.output_port<int>("/face");
  face.signal();
  EXPECT_EQ(waiting.exit_code(), 0);
}

TEST(Wait, SaysThatAWinnerIsSelectedThatCannotDeliver) {
  Daemon daemon(kGazeModel);
  Node sender("sender");
  Node receiver("receiver");
  auto gaze = receiver.input_port<int>("/gaze");
  auto face = sender.output_port<double>("/face");
  face.signal();
  const auto result = wait_until("idle(/gaze)", {"--timeout", "0s"});
  EXPECT_EQ(result.exit_code, kTimedOut);
  EXPECT_THAT(result.err,
              HasSubstr("  /face is selected at /gaze, but cannot deliver  (arbiter why /gaze)\n"));
}

TEST(Wait, GoesOnWhileNoDaemonRunsAndWithTheNextOne) {
  Daemon daemon(kGazeModel);
  Node node("test");
  auto face = node.output_port<int>("/face");
  auto random = node.output_port<int>("/random");
  {
    Waiting waiting(daemon, "winner(/gaze) = /face");
    daemon.kill();
    waiting.see("the daemon has gone");
    face.signal();
    EXPECT_EQ(waiting.exit_code(), 0);
  }
  face.deactivate();
  daemon.restart();
  Waiting waiting(daemon, "winner(/gaze) = /random");
  daemon.kill();
  waiting.see("the daemon has gone");
  daemon.restart();
  waiting.see("a daemon is there again");
  random.signal();
  EXPECT_EQ(waiting.exit_code(), 0);
}

TEST(Wait, TakesUpOtherModelsAndEndsWithOneThatLacksAName) {
  Daemon daemon(kGazeModel);
  Node node("test");
  auto face = node.output_port<int>("/face");
  Waiting waiting(daemon, "winner(/gaze) = /face");
  daemon.load("<behaviors><arbiter at='/gaze'><select from='/face'/></arbiter></behaviors>");
  daemon.load("<behaviors><arbiter at='/gaze'><select from='/fast'/></arbiter></behaviors>");
  EXPECT_EQ(waiting.exit_code(), 1);
  EXPECT_THAT(
      waiting.error(),
      AllOf(HasSubstr("--until:1:17: error: /face is not connected to /gaze, so that it can "
                      "never win there; did you mean \"/fast\"? [not-connected]"),
            HasSubstr("model 3, which is in force, gives this condition no meaning")));
}

TEST(Wait, WithoutADaemonOrWithAConditionThatCannotBeReadIsAnError) {
  {
    Daemon daemon(kGazeModel);
    for (const std::string condition :
         {"", "  ", "is_active(/face)", "/face and", "/face\x01", "=0"}) {
      const auto result = wait_until(condition, {"--timeout", "0s"});
      EXPECT_EQ(result.exit_code, 2) << condition;
      EXPECT_THAT(result.err, HasSubstr("--until")) << condition;
    }
    EXPECT_EQ(wait_until("/face", {"--timeout", "5"}).exit_code, 2);
    EXPECT_EQ(wait_until("/face", {"--timeout", "0"}).exit_code, 2);
    EXPECT_EQ(wait_until("/face", {"--for", "-1s"}).exit_code, 2);
    EXPECT_EQ(arbiter({"wait"}).exit_code, 2);
  }
  auto result = wait_until("/face", {"--instance", "nobody-has-this-instance"});
  EXPECT_EQ(result.exit_code, 1);
  EXPECT_THAT(result.err, HasSubstr("no arbiterd of instance"));
  result = wait_until("/face", {"--instance", "nobody-has-this-instance", "--timeout", "1ms"});
  EXPECT_EQ(result.exit_code, 1);
  EXPECT_THAT(result.err,
              HasSubstr("arbiter: timed out after 0.001 s; at the last try: no arbiterd "
                        "of instance \"nobody-has-this-instance\" answered within 1 ms "));
}

}  // namespace
}  // namespace arbiter::test
