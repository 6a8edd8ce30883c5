// What killing a process of the demo on two hosts does: the table of examples/hosts/README.md, row
// by row. The same programs and the same rules, without the demo's script: the object and the face
// are always in sight, and who is killed comes back when the test has seen what it did.
#include <fcntl.h>
#include <gtest/gtest.h>
#include <signal.h>

#include <memory>
#include <sstream>
#include <string>
#include <vector>

#include "tests/demo/demo.hpp"
#include "tests/demo/terminal_session.hpp"
#include "tests/link/scene.hpp"

namespace arbiter::test {
namespace {

constexpr std::size_t kEnoughOrders = 20;

// Longer than a process may have to wait for a processor: only who is killed falls silent.
std::string patient_model() {
  std::string text = content_of(SEARCH_AND_TRACK "/search_and_track.xml");
  const std::string timeout = "timeout=\"500ms\"";
  return text.replace(text.find(timeout), timeout.size(), "timeout=\"2500ms\"");
}

// A component, and what it says in all its lives.
class Actor {
 public:
  Actor(std::string program, std::string instance, std::string log,
        std::vector<std::string> arguments)
      : instance_(std::move(instance)), log_(std::move(log)), command_(std::move(arguments)) {
    command_.insert(command_.begin(), ARBITER_PROGRAMS "/search-and-track/" + std::move(program));
    start();
  }
  void start() {
    const shm::FileDescriptor log(
        ::open(log_.c_str(), O_WRONLY | O_CREAT | O_APPEND | O_CLOEXEC, 0600));
    process_ =
        ChildProcess(command_, {{"ARBITER_INSTANCE", instance_}}, {-1, log.get(), log.get()});
  }
  void kill() { process_.kill(); }
  // Of a motor: who gave it each order, or "idle".
  [[nodiscard]] std::vector<std::string> commanders() const {
    std::vector<std::string> result;
    std::istringstream lines(content_of(log_));
    for (std::string line; std::getline(lines, line) && !lines.eof();) {
      result.push_back(line.substr(0, line.find(' ')));
    }
    return result;
  }

 private:
  const std::string instance_;
  const std::string log_;
  std::vector<std::string> command_;
  ChildProcess process_;
};

class KilledAlone : public LoopbackHosts {
 protected:
  KilledAlone() { expect("/Object/pos:o", "/Object/pos:o"); }

  [[nodiscard]] std::unique_ptr<Actor> actor(const std::string& program, const std::string& host,
                                             std::vector<std::string> arguments = {}) const {
    return std::make_unique<Actor>(program, host, logs_.file(program), std::move(arguments));
  }
  // Returns once these command the motors.
  void expect(const std::string& gaze, const std::string& arm) {
    await_commander(*gaze_, gaze);
    await_commander(*arm_, arm);
  }
  static void await_commander(const Actor& motor, const std::string& source) {
    await([&] {
      const auto all = motor.commanders();
      return !all.empty() && all.back() == source;
    });
  }
  // Nobody but these commands the motors for so many orders.
  void expect_no_change(const std::string& gaze, const std::string& arm) {
    const std::size_t gazes = gaze_->commanders().size();
    const std::size_t arms = arm_->commanders().size();
    expect_only(*gaze_, gazes, gaze);
    expect_only(*arm_, arms, arm);
  }
  static void expect_only(const Actor& motor, std::size_t from, const std::string& source) {
    await([&] { return motor.commanders().size() >= from + kEnoughOrders; });
    const auto all = motor.commanders();
    for (std::size_t i = from; i < all.size(); ++i) ASSERT_EQ(all[i], source);
  }

  const TemporaryDirectory logs_;
  Host head_{"head", runtime_, patient_model(), network()};
  Host body_{"body", runtime_, patient_model(), network()};
  const std::unique_ptr<Actor> face_ = actor("face-detector", "head");
  const std::unique_ptr<Actor> object_ = actor("object-detector", "head");
  const std::unique_ptr<Actor> random_look_ = actor("random-look", "body");
  const std::unique_ptr<Actor> rest_arm_ = actor("rest-arm", "body");
  const std::unique_ptr<Actor> collision_ =
      actor("collision-detector", "body", {"--active", "1000000-1000001"});
  const std::unique_ptr<Actor> gaze_ = actor("gaze-control", "body");
  const std::unique_ptr<Actor> arm_ = actor("arm-control", "body");
};

TEST_F(KilledAlone, ADaemonChangesNothing) {
  for (Host* const host : {&head_, &body_}) {
    host->daemon().kill();
    expect_no_change("/Object/pos:o", "/Object/pos:o");
    host->daemon().restart();
    expect_no_change("/Object/pos:o", "/Object/pos:o");
  }
}

TEST_F(KilledAlone, ALinkIsSilence) {
  for (Host* const host : {&head_, &body_}) {
    host->link().kill();
    expect("/RandomLook/pos:o", "/RestArm/pos:o");
    host->start_link();
    expect("/Object/pos:o", "/Object/pos:o");
  }
}

TEST_F(KilledAlone, ADetectorGivesWayToTheNextInCommand) {
  object_->kill();
  expect("/Face/pos:o", "/RestArm/pos:o");
  face_->kill();
  expect("/RandomLook/pos:o", "/RestArm/pos:o");
  face_->start();
  expect("/Face/pos:o", "/RestArm/pos:o");
  object_->start();
  expect("/Object/pos:o", "/Object/pos:o");
}

TEST_F(KilledAlone, WhatTheMotorsFallBackToIsMissedOnlyWhileNobodyElseCommands) {
  for (Actor* const each : {random_look_.get(), rest_arm_.get()}) {
    each->kill();
    expect_no_change("/Object/pos:o", "/Object/pos:o");
    each->start();
  }
  head_.link().kill();
  expect("/RandomLook/pos:o", "/RestArm/pos:o");
  random_look_->kill();
  expect("idle", "/RestArm/pos:o");
  random_look_->start();
  expect("/RandomLook/pos:o", "/RestArm/pos:o");
  rest_arm_->kill();
  expect("/RandomLook/pos:o", "idle");
  rest_arm_->start();
  expect("/RandomLook/pos:o", "/RestArm/pos:o");
}

TEST_F(KilledAlone, AMotorStandsStillUntilTheNextProcess) {
  for (Actor* const motor : {gaze_.get(), arm_.get()}) {
    motor->kill();
    const std::size_t orders = motor->commanders().size();
    motor->start();
    await([&] { return motor->commanders().size() >= orders + kEnoughOrders; });
    await_commander(*motor, "/Object/pos:o");
  }
}

TEST_F(KilledAlone, ASilentDetectorChangesNothing) {
  collision_->kill();
  expect_no_change("/Object/pos:o", "/Object/pos:o");
  collision_->start();
  expect_no_change("/Object/pos:o", "/Object/pos:o");
}

// That its networks go with it cannot be seen from outside, for they have no names.
TEST(KilledDemo, TakesAllOfThemWithIt) {
  const Demo demo;
  const OwnDomain domain;
  std::vector<std::string> command = demo.command(
      {"--lines", "--loopback", "--seconds", "3600", "--domain", std::to_string(domain.number())});
  for (std::string& word : command) {
    if (word == ARBITER_PROGRAMS "/search-and-track-demo") word = ARBITER_PROGRAMS "/hosts-demo";
  }
  TerminalSession session(command, 24, 100);
  session.watch_until(
      [&] { return session.written().find("/Arm/pos:i  /RestArm/pos:o") != std::string::npos; });
  EXPECT_EQ(demo.processes().size(), 12U) << "the demo, and eleven that it has started";
  session.send(SIGKILL);
  EXPECT_EQ(session.watch_to_the_end(), 128 + SIGKILL);
  EXPECT_TRUE(demo.processes_after_a_while().empty());
}

}  // namespace
}  // namespace arbiter::test
