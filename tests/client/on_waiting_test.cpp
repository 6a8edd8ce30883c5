// NodeOptions::on_waiting: on which thread it is called, under no lock, and what becomes of what it
// throws.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <atomic>
#include <chrono>
#include <functional>
#include <memory>
#include <optional>
#include <stdexcept>
#include <string>
#include <thread>
#include <utility>

#include <arbiter/arbiter.hpp>

#include "tests/client/models.hpp"
#include "tests/client/samples.hpp"
#include "tests/support/daemon.hpp"

namespace arbiter::test {
namespace {

using namespace std::chrono_literals;

struct Cancelled : std::runtime_error {
  using std::runtime_error::runtime_error;
};

// on_waiting is called as well where a daemon that runs is slow to answer: of that it hears nothing
// here, but of what is waited for once `is_killed`.
NodeOptions patient(const std::atomic<bool>& is_killed,
                    std::function<void(const std::string&)> on_waiting) {
  NodeOptions options;
  options.connect_timeout = 1h;
  options.on_waiting = [&is_killed, on_waiting = std::move(on_waiting)](const std::string& whom) {
    if (is_killed) on_waiting(whom);
  };
  return options;
}

TEST(OnWaiting, IsCalledOnTheThreadThatWaits) {
  Daemon daemon(single_model());
  std::thread::id called_on;
  std::atomic<bool> is_killed{false};
  Node node("test", patient(is_killed, [&](const std::string&) {
              called_on = std::this_thread::get_id();
              daemon.restart();
            }));
  is_killed = true;
  daemon.kill();
  auto out = node.output_port<Number>("/out");
  EXPECT_EQ(called_on, std::this_thread::get_id());
}

// It may be stopped, or busy: how long it is waited for is not the time that one is looked for.
TEST(OnWaiting, SaysForWhomItWaitsAndForHowLongAtMost) {
  Daemon daemon(single_model());
  daemon.process().stop();
  std::string said;
  NodeOptions options;
  options.connect_timeout = 100ms;
  options.on_waiting = [&said](const std::string& text) { said = text; };
  EXPECT_THROW(Node("test", options), Error);
  EXPECT_THAT(said, testing::MatchesRegex("\"test\" waits for arbiterd.* of instance \"test\" to "
                                          "answer, at most 1100 ms"));
  daemon.kill();
  options.connect_timeout = 600ms;
  EXPECT_THROW(Node("test", options), Error);
  EXPECT_EQ(said, "\"test\" waits for an arbiterd of instance \"test\", at most 1600 ms");
}

TEST(OnWaiting, OfAPortThatIsOpenedSaysForHowLongAtMost) {
  Daemon daemon(single_model());
  std::string said;
  std::atomic<bool> is_killed{false};
  NodeOptions options = patient(is_killed, [&said](const std::string& text) { said = text; });
  options.connect_timeout = 600ms;
  Node node("test", options);
  is_killed = true;
  daemon.kill();
  EXPECT_THROW(static_cast<void>(node.output_port<Number>("/out")), Error);
  EXPECT_EQ(said, "\"test\" waits for an arbiterd of instance \"test\", at most 1000 ms");
}

TEST(OnWaiting, OfADaemonThatIsStoppedSaysThatItHasNotAnswered) {
  Daemon daemon(single_model());
  std::string said;
  NodeOptions options;
  options.connect_timeout = 600ms;
  options.on_waiting = [&said](const std::string& text) { said = text; };
  Node node("test", options);
  said.clear();
  daemon.process().stop();
  EXPECT_THROW(static_cast<void>(node.output_port<Number>("/out")), Error);
  EXPECT_THAT(said, testing::MatchesRegex("\"test\" waits for arbiterd.* of instance \"test\" to "
                                          "answer, at most 1000 ms"));
  said.clear();
  EXPECT_THROW(node.switch_model("other"), Error);
  EXPECT_THAT(said, testing::HasSubstr("to answer, at most 1000 ms"));
  daemon.kill();
}

// Under a lock of the node's this would never return.
TEST(OnWaiting, MayOpenAndClosePortsOfTheSameNode) {
  Daemon daemon(override_model());
  Node* self = nullptr;
  auto held = std::make_unique<std::optional<OutputPort<Number>>>();
  int calls = 0;
  std::atomic<bool> is_killed{false};
  Node node("test", patient(is_killed, [&](const std::string&) {
              ++calls;
              held->reset();
              daemon.restart();
              held->emplace(self->output_port<Number>("/high"));
            }));
  self = &node;
  held->emplace(node.output_port<Number>("/stop"));
  is_killed = true;
  daemon.kill();
  auto out = node.output_port<Number>("/low");
  EXPECT_EQ(calls, 1);
  EXPECT_EQ((*held)->name(), "/high");
  EXPECT_TRUE(daemon.source("/high")["open"]);
  EXPECT_TRUE(daemon.source("/low")["open"]);
  EXPECT_FALSE(daemon.source("/stop")["open"]);
}

// A call of its own that waits as well does not call it again.
TEST(OnWaiting, IsNotCalledFromWithinItself) {
  Daemon daemon(override_model());
  Node* self = nullptr;
  int calls = 0;
  std::atomic<bool> is_killed{false};
  NodeOptions options = patient(is_killed, [&](const std::string&) {
    ++calls;
    EXPECT_THROW(static_cast<void>(self->output_port<Number>("/high")), Error);
    daemon.restart();
  });
  options.connect_timeout = 1500ms;
  Node node("test", options);
  self = &node;
  is_killed = true;
  daemon.kill();
  try {
    static_cast<void>(node.output_port<Number>("/low"));
  } catch (const Error&) {  // the call within has used up its time
  }
  EXPECT_EQ(calls, 1);
}

TEST(OnWaiting, WhatItThrowsLeavesTheOpeningOfThePortWhichHasNotHappened) {
  Daemon daemon(single_model());
  std::atomic<bool> is_killed{false};
  Node node("test", patient(is_killed, [](const std::string&) { throw Cancelled("enough"); }));
  is_killed = true;
  daemon.kill();
  EXPECT_THROW(static_cast<void>(node.output_port<Number>("/out")), Cancelled);
  EXPECT_THROW(static_cast<void>(node.input_port<Number>("/in")), Cancelled);
  is_killed = false;
  daemon.restart();
  auto out = node.output_port<Number>("/out");
  auto in = node.input_port<Number>("/in");
  EXPECT_EQ(out.publish(Number{1}).delivered, 1u);
  EXPECT_EQ(take_from(in), 1);
}

TEST(OnWaiting, WhatItThrowsLeavesTheMakingOfTheNode) {
  Daemon daemon(single_model());
  const std::atomic<bool> is_killed{true};
  daemon.kill();
  EXPECT_THROW(
      Node("test", patient(is_killed, [](const std::string&) { throw Cancelled("enough"); })),
      Cancelled);
  EXPECT_THROW(Node("test", patient(is_killed, [](const std::string&) { throw 7; })), int);
  daemon.restart();
}

// The name stays another's, of whoever comes first.
TEST(OnWaiting, APortWhoseOpeningWasCancelledHasItsNameFree) {
  Daemon daemon(single_model());
  std::atomic<bool> is_killed{false};
  Node node("test", patient(is_killed, [](const std::string&) { throw Cancelled("enough"); }));
  auto in = node.input_port<Number>("/in");
  is_killed = true;
  daemon.kill();
  EXPECT_THROW(static_cast<void>(node.output_port<Number>("/out")), Cancelled);
  daemon.restart();
  Node other("other");
  auto out = other.output_port<Number>("/out");
  EXPECT_EQ(out.publish(Number{1}).delivered, 1u);
}

}  // namespace
}  // namespace arbiter::test
