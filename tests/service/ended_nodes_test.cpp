// A daemon takes over when a component has no port left, or has ended while there was no daemon.
#include <gtest/gtest.h>

#include <optional>

#include <arbiter/arbiter.hpp>

#include "tests/client/component.hpp"
#include "tests/client/models.hpp"
#include "tests/client/samples.hpp"
#include "tests/support/await.hpp"
#include "tests/support/daemon.hpp"

namespace arbiter::test {
namespace {

void expect_what_was_active(Daemon& daemon, Node& node) {
  daemon.kill();
  daemon.restart();
  EXPECT_TRUE(daemon.source("/stop")["active"]);
  EXPECT_EQ(daemon.generation(), 2u);
  auto low = node.output_port<Number>("/low");
  EXPECT_EQ(low.publish(Number{1}).delivered, 0u);
}

TEST(Takeover, FromAComponentWithoutPortsKeepsWhatIsActive) {
  Daemon daemon(override_model());
  Node node("test");
  auto in = std::make_optional(node.input_port<Number>("/in"));
  node.output_port<Number>("/stop").signal();
  in.reset();
  expect_what_was_active(daemon, node);
}

TEST(Takeover, FromAComponentThatOnlyTapsKeepsWhatIsActive) {
  Daemon daemon(override_model());
  Node node("test");
  node.output_port<Number>("/stop").signal();
  auto tap = node.tap<Number>("/low");
  expect_what_was_active(daemon, node);
  await([&] { return tap.take().has_value(); });
}

TEST(Takeover, AComponentWithoutPortsIsANewcomerToOtherMemory) {
  Daemon daemon(single_model());
  Node node("test");
  static_cast<void>(node.output_port<Number>("/out"));
  daemon.kill();
  daemon.lose_state();
  daemon.restart();
  EXPECT_EQ(daemon.generation(), 1u);
  auto in = node.input_port<Number>("/in");
  auto out = node.output_port<Number>("/out");
  EXPECT_EQ(out.publish(Number{1}).delivered, 1u);
  EXPECT_EQ(take_from(in), 1);
  EXPECT_TRUE(daemon.status()["strangers"].empty());
}

// Its process lives, so the next daemon would keep its ports for it.
TEST(Takeover, OfANodeThatHasEndedTheNextOneOfItsProcessFreesThePorts) {
  Daemon daemon(single_model());
  Component other("other");  // by which the next daemon takes over
  ASSERT_EQ(other.tell("input /in 1 1 0"), "open");
  {
    Node node("test");
    auto out = node.output_port<Number>("/out");
    daemon.kill();
  }
  daemon.restart();
  Node node("test");
  auto out = node.output_port<Number>("/out");
  EXPECT_EQ(out.publish(Number{1}).delivered, 1u);
}

TEST(Takeover, OfANodeThatHasEndedAnotherOneOfItsProcessFreesThePorts) {
  Daemon daemon(single_model());
  Node node("test");
  auto in = node.input_port<Number>("/in");
  {
    Node ended("ended");
    auto out = ended.output_port<Number>("/out");
    daemon.kill();
  }
  daemon.restart();
  Component other("other");
  ASSERT_EQ(other.tell("output /out"), "open");
  EXPECT_EQ(other.tell("publish /out 1"), "1 0 0");
  EXPECT_EQ(take_from(in), 1);
}

// What it said last is in the socket of a daemon that does not read any more.
TEST(Takeover, OfANodeThatEndsBeforeAStoppedDaemonThePortsAreFreedToo) {
  Daemon daemon(single_model());
  Node node("test");
  auto in = node.input_port<Number>("/in");
  {
    Node ended("ended");
    auto out = ended.output_port<Number>("/out");
    daemon.process().stop();
  }
  daemon.kill();
  daemon.restart();
  auto out = node.output_port<Number>("/out");
  EXPECT_EQ(out.publish(Number{1}).delivered, 1u);
  EXPECT_EQ(take_from(in), 1);
}

}  // namespace
}  // namespace arbiter::test
