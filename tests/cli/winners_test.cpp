// arbiter winners: changes of winner as a component takes them.
#include <gtest/gtest.h>
#include <poll.h>
#include <signal.h>

#include <chrono>
#include <optional>
#include <string>
#include <vector>

#include <arbiter/arbiter.hpp>

#include "tests/cli/why_program.hpp"
#include "tests/support/await.hpp"
#include "tests/support/child_process.hpp"
#include "tests/support/daemon.hpp"
#include "tests/support/text_files.hpp"

namespace arbiter::test {
namespace {

using namespace std::chrono_literals;

const std::string kBehaviours = R"(
<behavior name="Look"><config at="/gaze:i">/random</config></behavior>
<behavior name="Follow"><config at="/gaze:i">/face</config><inhibition>Look</inhibition></behavior>
<behavior name="Tell"><config at="/news">/arbiter/winner/gaze:i:o</config></behavior>
</behaviors>)";
const std::string kWinnersModel = R"(<behaviors timeout="forever">)" + kBehaviours;

class Winners : public testing::Test {
 protected:
  void start(std::vector<std::string> more = {}) {
    more.insert(more.begin(),
                {std::string(ARBITER_PROGRAMS) + "/arbiter", "winners", "--every", "10ms"});
    const shm::FileDescriptor err(
        ::open(err_path().c_str(), O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC, 0600));
    program_ = ChildProcess(more, {}, {-1, -1, err.get()});
  }
  // The next sample that is not a repetition.
  WinnerChange next() {
    for (;;) {
      const auto sample = in_.wait_for(1h);
      if (sample && (*sample)->news != WinnerNews::unchanged) return **sample;
    }
  }
  WinnerChange repetition() {
    for (;;) {
      const auto sample = in_.wait_for(1h);
      if (sample && (*sample)->news == WinnerNews::unchanged) return **sample;
    }
  }
  [[nodiscard]] std::string err_path() const { return daemon_.directory() + "/winners.err"; }

  Daemon daemon_{kWinnersModel};
  Node node_{"test"};
  OutputPort<int> random_ = node_.output_port<int>("/random");
  OutputPort<int> face_ = node_.output_port<int>("/face");
  // Many repetitions fit in: on a busy machine they must not push out what they repeat.
  InputPort<WinnerChange> in_ = node_.input_port<WinnerChange>("/news", {.depth = 1024});
  ChildProcess program_;
};

TEST_F(Winners, AreToldToAComponent) {
  random_.signal();
  start({"--port", "/gaze*"});
  // What was published before this port was connected is not for it: the repetitions are.
  WinnerChange seen = repetition();
  EXPECT_STREQ(seen.port, "/gaze:i");
  EXPECT_STREQ(seen.winner, "/random");
  EXPECT_EQ(seen.is_arbitrated, 1U);
  EXPECT_EQ(seen.generation, 1U);

  const Time before = std::chrono::steady_clock::now();
  face_.signal();
  seen = next();
  EXPECT_EQ(seen.news, WinnerNews::change);
  EXPECT_STREQ(seen.winner, "/face");
  EXPECT_STREQ(seen.before, "/random");
  EXPECT_EQ(seen.changes, 1U);
  EXPECT_GE(seen.time_ns, before.time_since_epoch().count());
  EXPECT_GE(seen.seen_ns, seen.time_ns);

  face_.deactivate();
  seen = next();
  EXPECT_STREQ(seen.winner, "/random");
  EXPECT_EQ(seen.changes, 2U);

  random_.deactivate();
  seen = next();
  EXPECT_STREQ(seen.winner, "");
  EXPECT_STREQ(seen.before, "/random");

  program_.signal(SIGTERM);
  EXPECT_EQ(program_.wait(), 0);
}

TEST_F(Winners, EndAtAHangup) {
  ::signal(SIGHUP, SIG_DFL);  // what a test was started with, the program has too
  start();
  repetition();
  program_.signal(SIGHUP);
  EXPECT_EQ(program_.wait(), 0);
}

TEST_F(Winners, AreThoseOfTheModelInForce) {
  random_.signal();
  start();
  repetition();
  daemon_.write_model(R"(<behaviors timeout="forever">
<behavior name="Tell"><config at="/news">/arbiter/winner/gaze:i:o</config></behavior>
</behaviors>)");
  ASSERT_EQ(arbiter({"reload"}).exit_code, 0);
  WinnerChange seen = next();
  EXPECT_STREQ(seen.winner, "");
  EXPECT_STREQ(seen.before, "/random");
  EXPECT_EQ(seen.is_arbitrated, 0U);
  EXPECT_EQ(seen.generation, 2U);
  daemon_.write_model(kWinnersModel);
  ASSERT_EQ(arbiter({"reload"}).exit_code, 0);
  seen = next();
  EXPECT_STREQ(seen.winner, "/random");
  EXPECT_EQ(seen.is_arbitrated, 1U);
  program_.signal(SIGINT);
  EXPECT_EQ(program_.wait(), 0);
}

TEST_F(Winners, AreAnnouncedByOneProgramOnly) {
  start();
  repetition();
  const auto second = arbiter({"winners"});
  EXPECT_EQ(second.exit_code, 1);
  EXPECT_NE(second.err.find("/arbiter/winner/gaze:i:o"), std::string::npos) << second.err;
}

TEST_F(Winners, AreAnnouncedWhereOnePortCannotBeOpened) {
  daemon_.write_model(R"(<behaviors timeout="forever">
<behavior name="Arm"><config at="/arm:i">/random</config></behavior>)" +
                      kBehaviours);
  ASSERT_EQ(arbiter({"reload"}).exit_code, 0);
  auto held = std::make_optional(node_.output_port<int>("/arbiter/winner/arm:i:o"));
  random_.signal();
  start();
  EXPECT_STREQ(repetition().port, "/gaze:i");
  face_.signal();
  EXPECT_STREQ(next().winner, "/face");
  std::string err = content_of(err_path());
  EXPECT_NE(err.find("trying again every second"), std::string::npos) << err;
  held.reset();
  while (err.find("announcing /arm:i as") == std::string::npos) {
    pollfd ended{program_.descriptor(), POLLIN, 0};
    ASSERT_EQ(::poll(&ended, 1, 10), 0) << err;
    err = content_of(err_path());
  }
  EXPECT_EQ(err.find("trying again"), err.rfind("trying again")) << err;
  EXPECT_EQ(err.find("does not mention"), std::string::npos)
      << "nobody need mention these: " << err;
  program_.signal(SIGINT);
  EXPECT_EQ(program_.wait(), 0);
}

TEST_F(Winners, AreNotHeldUpByPortsThatAStoppedDaemonDoesNotOpen) {
  std::string model = R"(<behaviors timeout="forever">)";
  std::vector<OutputPort<int>> held;
  for (const std::string arm : {"/arm1", "/arm2", "/arm3"}) {
    model += "<behavior name=\"" + arm.substr(1) + "\"><config at=\"" + arm +
             "\">/random</config></behavior>";
    held.push_back(node_.output_port<int>("/arbiter/winner" + arm + ":o"));
  }
  daemon_.load(model + kBehaviours);
  start();
  repetition();
  await([&] { return content_of(err_path()).find("/arm3:o") != std::string::npos; });
  daemon_.process().signal(SIGSTOP);
  // The ports are tried again meanwhile.
  const auto stopped = repetition().seen_ns;
  while (repetition().seen_ns < stopped + 3'000'000'000) {
  }
  EXPECT_EQ(content_of(err_path()).find("waiting for"), std::string::npos);
  EXPECT_EQ(content_of(err_path()).find("5 seconds"), std::string::npos);
  face_.signal();
  EXPECT_STREQ(next().winner, "/face");
  daemon_.process().signal(SIGCONT);
  held.clear();
  await([&] { return content_of(err_path()).find("announcing /arm3 as") != std::string::npos; });
  program_.signal(SIGINT);
  EXPECT_EQ(program_.wait(), 0);
}

TEST_F(Winners, AreAnnouncedAnewBehindADaemonThatDoesNotKnowThem) {
  start();
  repetition();
  daemon_.kill();
  daemon_.lose_state();
  program_.signal(SIGSTOP);  // so that there is a winner by the time that it looks
  daemon_.restart();
  Node node("again");
  auto face = node.output_port<int>("/face");
  auto arm = node.input_port<int>("/gaze:i");
  face.signal();
  in_ = node.input_port<WinnerChange>("/news", {.depth = 1024});
  program_.signal(SIGCONT);
  WinnerChange seen = next();
  EXPECT_EQ(seen.news, WinnerNews::start) << "who won before is no change";
  EXPECT_STREQ(seen.winner, "/face");
  EXPECT_EQ(seen.changes, 0U);
  face.deactivate();
  seen = next();
  EXPECT_EQ(seen.news, WinnerNews::change);
  EXPECT_STREQ(seen.before, "/face");
  const std::string err = content_of(err_path());
  const auto said = err.find("does not know what was before: announcing starts again\n");
  EXPECT_NE(said, std::string::npos) << err;
  EXPECT_EQ(said, err.rfind("does not know what was before")) << err;
  program_.signal(SIGINT);
  EXPECT_EQ(program_.wait(), 0);
}

TEST_F(Winners, OfAPatternThatMatchesNothingAreNoneAndItSaysSo) {
  start({"--port", "/gase*", "--port", "/face"});
  const auto said = [&](const char* text) {
    return content_of(err_path()).find(text) != std::string::npos;
  };
  await([&] { return said("/face is an output port: name an input port"); });
  EXPECT_TRUE(
      said("warning: --port '/gase*' matches no input port that the model in force "
           "arbitrates; did you mean \"/gaze*\"?"));
  program_.signal(SIGINT);
  EXPECT_EQ(program_.wait(), 0);
}

TEST_F(Winners, OfAPortThatAnotherModelDoesNotArbitrateAreSaidToBeNone) {
  random_.signal();
  start({"--port", "/gaze:i"});
  repetition();
  daemon_.load(R"(<behaviors timeout="forever">
<behavior name="Tell"><config at="/news">/arbiter/winner/gaze:i:o</config></behavior>
</behaviors>)");
  await([&] {
    return content_of(err_path())
               .find("--port /gaze:i matches no input port that the model in force arbitrates") !=
           std::string::npos;
  });
}

TEST(WinnersOfADaemon, ThatTellsNoMoreAreNotTakenForAll) {
  const TemporaryDirectory files;
  const std::string policy = files.write("policy", "allow everyone all\n");
  Daemon daemon(kWinnersModel, {.arguments = {"--policy", policy}});
  const std::string path = daemon.directory() + "/winners.err";
  const shm::FileDescriptor err(
      ::open(path.c_str(), O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC, 0600));
  ChildProcess program({std::string(ARBITER_PROGRAMS) + "/arbiter", "winners"}, {},
                       {-1, -1, err.get()});
  const auto says = [&](const char* text) {
    await([&] { return content_of(path).find(text) != std::string::npos; });
  };
  says("announcing /gaze:i");
  files.write("policy", "deny everyone observe\nallow everyone all\n");
  daemon.write_model(R"(<behaviors timeout="1000s">)" + kBehaviours);
  daemon.hang_up();
  says("the daemon refuses to tell");
  files.write("policy", "allow everyone all\n");
  daemon.write_model(kWinnersModel);
  daemon.hang_up();
  says("the daemon tells again");
  program.signal(SIGINT);
  EXPECT_EQ(program.wait(), 0);
}

TEST(WinnersWithoutADaemon, AreNone) {
  const auto result = arbiter({"winners", "--instance", "nobody-has-this"});
  EXPECT_EQ(result.exit_code, 1);
  EXPECT_NE(result.err.find("nobody-has-this"), std::string::npos) << result.err;
}

TEST(WinnersOptions, AreChecked) { EXPECT_EQ(arbiter({"winners", "--every", "1ms"}).exit_code, 2); }

}  // namespace
}  // namespace arbiter::test
