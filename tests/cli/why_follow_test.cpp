// arbiter why --follow: each change of a port's winner as it comes, and who decides.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <poll.h>
#include <unistd.h>

#include <arbiter/arbiter.hpp>
#include <nlohmann/json.hpp>

#include "tests/cli/why_program.hpp"
#include "tests/support/daemon.hpp"

namespace arbiter::test {
namespace {

using nlohmann::json;
using testing::AllOf;
using testing::HasSubstr;

// A program whose output is read as it comes.
class Followed {
 public:
  explicit Followed(std::vector<std::string> arguments) {
    arguments.insert(arguments.begin(), {std::string(ARBITER_PROGRAMS) + "/arbiter", "why"});
    const shm::FileDescriptor out = make_pipe(out_);
    const shm::FileDescriptor err = make_pipe(err_);
    process_ = ChildProcess(arguments, {}, {-1, out.get(), err.get()});
  }

  std::string line() { return read_line(out_); }
  std::string error_line() { return read_line(err_); }
  json object() { return json::parse(line()); }
  [[nodiscard]] bool has_said_something() const {
    pollfd readable{out_.get(), POLLIN, 0};
    return ::poll(&readable, 1, 5) == 1;
  }
  ChildProcess& process() { return process_; }

 private:
  // Where it is written to.
  static shm::FileDescriptor make_pipe(shm::FileDescriptor& read_end) {
    int ends[2];
    if (::pipe2(ends, O_CLOEXEC) != 0) throw std::runtime_error("pipe2");
    read_end.reset(ends[0]);
    return shm::FileDescriptor(ends[1]);
  }
  static std::string read_line(const shm::FileDescriptor& from) {
    std::string text;
    char c = 0;
    while (::read(from.get(), &c, 1) == 1 && c != '\n') text += c;
    return text;
  }

  shm::FileDescriptor out_, err_;
  ChildProcess process_;
};

TEST(WhyFollow, FollowsTheWinnersOfThePapersScenario) {
  Daemon daemon(kGazeModel);
  Node node("test");
  auto random = node.output_port<int>("/random");
  auto face = node.output_port<int>("/face");
  auto object = node.output_port<int>("/object");
  auto collision = node.output_port<int>("/collision");
  Followed followed({"/gaze", "--follow", "--count", "6"});
  EXPECT_THAT(followed.line(), HasSubstr("  /gaze: idle"));
  random.signal();
  EXPECT_THAT(followed.line(), HasSubstr("  idle -> /random  because /random became active"));
  face.signal();
  EXPECT_THAT(followed.line(),
              HasSubstr("  /random -> /face  because /face became active; /random is inhibited by "
                        "behaviour \"Follow\" (" +
                        daemon.directory() + "/model.xml:4)"));
  object.signal();
  EXPECT_THAT(followed.line(), HasSubstr("  /face -> /object  because /object became active; /face "
                                         "is inhibited by behaviour \"Track\" through"));
  collision.signal();
  EXPECT_THAT(followed.line(), HasSubstr("  /object -> idle  because /collision became active; "
                                         "/object is out: the condition of"));
  collision.deactivate();
  EXPECT_THAT(followed.line(), HasSubstr("  idle -> /object  because /collision was deactivated"));
  object.deactivate();
  EXPECT_THAT(followed.line(), HasSubstr("  /object -> /face  because /object was deactivated"));
  EXPECT_EQ(followed.process().wait(), 0);
}

TEST(WhyFollow, FollowsActivityThatRunsOutAndModelsThatComeIntoForce) {
  const auto model = [](const std::string& condition) {
    return "<behaviors timeout='forever'><source port='/high' timeout='30ms'/><arbiter at='/in'>"
           "<select from='/low'>" +
           condition + "</select><select from='/high'/></arbiter></behaviors>";
  };
  Daemon daemon(model("not /high"));
  Node node("test");
  auto low = node.output_port<int>("/low");
  auto high = node.output_port<int>("/high");
  low.signal();
  Followed followed({"/in", "--follow", "--json"});
  EXPECT_EQ(followed.object()["winner"], "/low");
  do {
    high.signal();  // until it has been seen
  } while (!followed.has_said_something());
  EXPECT_EQ(followed.object()["winner"], "/high");
  json change = followed.object();
  EXPECT_EQ(change["old"], "/high");
  EXPECT_EQ(change["winner"], "/low");
  EXPECT_EQ(change["because"][0]["source"], "/high");
  EXPECT_EQ(change["because"][0]["became"], "expired");
  EXPECT_EQ(change["because"][0]["at_ns"], change["at_ns"]) << "exactly when it ended";
  daemon.load(model("not /high and /never"));
  change = followed.object();
  EXPECT_EQ(change["winner"], nullptr);
  EXPECT_EQ(change["model"], 2);
  EXPECT_EQ(change["because"], json::array());
  EXPECT_THAT(change["old_loses"].get<std::string>(), HasSubstr("/never is inactive"));
  followed.process().signal(SIGINT);
  EXPECT_EQ(followed.process().wait(), 0);
}

TEST(WhyFollow, FollowsOnWhileNoDaemonRunsAndExplainsByTheModelThatDecides) {
  Daemon daemon(kGazeModel);
  Node node("test");
  auto random = node.output_port<int>("/random");
  auto face = node.output_port<int>("/face");
  Followed followed({"/gaze", "--follow"});
  EXPECT_THAT(followed.line(), HasSubstr("  /gaze: idle, by model 1 ("));
  daemon.kill();
  random.signal();
  EXPECT_THAT(followed.line(), HasSubstr("  idle -> /random  because"));
  face.signal();
  EXPECT_THAT(followed.line(), HasSubstr("/random is inhibited by behaviour \"Follow\" ("));
  daemon.restart();  // takes over what is open, and puts its own model in force
  face.deactivate();
  EXPECT_THAT(followed.line(), HasSubstr("  /face -> /random  because"));
  daemon.load(kNoRules);
  EXPECT_THAT(followed.line(), AllOf(HasSubstr("  /random -> not mentioned  because model "),
                                     HasSubstr(" (" + daemon.directory() +
                                               "/model.xml) came into "
                                               "force (reload, by ")));
}

TEST(WhyFollow, TellsWhatIsDeliveredFromWhatTheModelDoesNotMention) {
  const std::string application =
      "<application><connection><from>/random</from><to>/free</to></connection></application>";
  Daemon daemon(kNoRules, {.application = application});
  Node node("test");
  auto in = node.input_port<int>("/unheard-of");
  Followed unmentioned({"/unheard-of", "--follow"});
  EXPECT_THAT(unmentioned.line(), AllOf(HasSubstr("  /unheard-of: model 1 ("),
                                        HasSubstr(") does not mention it: no connection leads")));
  Followed free({"/free", "--follow"});
  EXPECT_THAT(free.line(), HasSubstr("  /free: not arbitrated, by model 1 ("));
  Followed as_json({"/unheard-of", "--follow", "--json"});
  const json start = as_json.object();
  EXPECT_EQ(start["mentioned"], false);
  EXPECT_EQ(start["arbitrated"], false);
  // Neither has rules, before and after.
  daemon.write_application(
      "<application><connection><from>/random</from><to>/unheard-of</to></connection>"
      "</application>");
  daemon.load(kNoRules);
  EXPECT_THAT(unmentioned.line(), HasSubstr("  not mentioned -> not arbitrated  because model 2"));
  EXPECT_THAT(free.line(), HasSubstr("  not arbitrated -> not mentioned  because model 2"));
  const json change = as_json.object();
  EXPECT_EQ(change["mentioned"], true);
  EXPECT_EQ(change["arbitrated"], false);
}

TEST(WhyFollow, SaysThatTheDaemonHasGoneAndThatOneIsThereAgain) {
  Daemon daemon(kGazeModel);
  Node node("test");
  auto random = node.output_port<int>("/random");
  Followed followed({"/gaze", "--follow"});
  EXPECT_THAT(followed.line(), HasSubstr("  /gaze: idle"));
  daemon.kill();
  EXPECT_THAT(followed.error_line(),
              HasSubstr("arbiter: the daemon has gone; its last decisions stay in force"));
  random.signal();
  EXPECT_THAT(followed.line(), HasSubstr("  idle -> /random  because"));
  daemon.restart();
  EXPECT_EQ(followed.error_line(), "arbiter: a daemon is there again");
}

TEST(WhyFollow, WaitsForADaemonThatDoesNotTellOfAModel) {
  Daemon daemon(kGazeModel);
  Followed followed({"/gaze", "--follow"});
  EXPECT_THAT(followed.line(), HasSubstr("  /gaze: idle"));
  followed.process().stop();
  daemon.load(kNoRules);
  daemon.process().stop();
  followed.process().resume();
  EXPECT_THAT(followed.error_line(), HasSubstr("does not tell of the model that has come into "));
  daemon.process().resume();
  EXPECT_THAT(followed.line(), HasSubstr("  idle -> not mentioned  because model 2"));
}

// The daemon gives the names of ports back that no model of its history needs.
TEST(WhyFollow, FollowsAPortThatHasAnotherIdSince) {
  Daemon daemon(kGazeModel);
  Node node("test");
  auto random = node.output_port<int>("/random");
  Followed followed({"/gaze", "--follow"});
  EXPECT_THAT(followed.line(), HasSubstr("  /gaze: idle"));
  for (int i = 0; i < 12; ++i) {
    daemon.load("<behaviors><arbiter at='/q" + std::to_string(i) +
                "'><select from='/random'/></arbiter></behaviors>");
  }
  EXPECT_THAT(followed.line(), HasSubstr("  idle -> not mentioned  because model "));
  daemon.load(kGazeModel);
  EXPECT_THAT(followed.line(), HasSubstr("  not mentioned -> idle  because model "));
  random.signal();
  EXPECT_THAT(followed.line(), HasSubstr("  idle -> /random  because "));
}

}  // namespace
}  // namespace arbiter::test
