// Components, and the daemon, that stop or die: nobody else is held up, nothing is lost for ever.
#include <gtest/gtest.h>

#include <arbiter/arbiter.hpp>

#include "tests/client/component.hpp"
#include "tests/client/models.hpp"
#include "tests/client/samples.hpp"
#include "tests/support/daemon.hpp"

namespace arbiter::test {
namespace {

TEST(Deaths, APublisherKilledFlatOutLeavesAPortThatWorks) {
  Daemon daemon(single_model());
  Node node("test");
  auto in = node.input_port<Number>("/in", {.depth = 16});
  std::int64_t received = 0;
  for (int i = 0; i < 30; ++i) {
    Component sender("sender");
    ASSERT_EQ(sender.tell("output /out"), "open");
    sender.begin("publish /out 0 1000000000");
    for (int taken = 0; taken < 50;) taken += in.wait_for(std::chrono::hours::max()) ? 1 : 0;
    sender.kill();
    while (in.take()) ++received;
  }
  auto successor = node.output_port<Number>("/out");
  EXPECT_EQ(successor.publish(Number{-7}).delivered, 1u);
  EXPECT_EQ((**in.wait_for(std::chrono::hours::max())).value, -7);
  EXPECT_EQ(daemon.input("/in")["misbehaved"], 0);
}

TEST(Deaths, AReceiverKilledFlatOutLeavesAPublisherThatWorks) {
  Daemon daemon(single_model());
  // It takes up its receivers when it is told to: on a machine that is busy a service thread may be
  // later than their opening, which waits for it no longer than 0.2 s.
  Node node("test", {.service_thread = false});
  auto out = node.output_port<Number>("/out");
  for (int i = 0; i < 20; ++i) {
    Component receiver("receiver");
    ASSERT_EQ(receiver.tell("input /in 4 2 0"), "open");
    node.service();
    receiver.begin("wait /in");
    receiver.begin("hold /in");
    receiver.begin("wait /in");
    for (int n = 0; n < 200; ++n) EXPECT_EQ(out.publish(Number{n}).delivered, 1u);
    receiver.kill();
    for (int n = 0; n < 200; ++n) out.publish(Number{n});
  }
  auto in = node.input_port<Number>("/in");
  EXPECT_EQ(out.publish(Number{1}).delivered, 1u);
  EXPECT_EQ(take_from(in), 1);
  EXPECT_EQ(daemon.source("/out")["no_slot"], 0);
}

TEST(Deaths, AStoppedComponentHoldsUpNobodysOpening) {
  Daemon daemon(fan_out_model(3));
  Component stopped("stopped");
  ASSERT_EQ(stopped.tell("input /in0 8 1 0"), "open");
  ASSERT_EQ(stopped.tell("output /out"), "open");
  stopped.process().stop();
  Node node("test");
  for (int i = 0; i < 3; ++i) auto in = node.input_port<Number>("/in1");
  daemon.load(fan_out_model(2));
  auto in = node.input_port<Number>("/in1");
  stopped.process().signal(SIGCONT);
  ASSERT_EQ(stopped.tell("input /elsewhere 8 1 0"), "open");
  EXPECT_EQ(stopped.tell("publish /out 5"), "2 0 0") << "it has taken up what it had missed";
  EXPECT_EQ(take_from(in), 5);
  EXPECT_EQ(stopped.tell("take /in0"), "5");
}

TEST(Deaths, AStoppedReceiverHoldsUpNoPublisher) {
  Daemon daemon(single_model());
  Component receiver("receiver");
  ASSERT_EQ(receiver.tell("input /in 4 1 0"), "open");
  Node node("test");
  auto out = node.output_port<Number>("/out");
  hear_all(receiver);
  EXPECT_EQ(out.publish(Number{-1}).delivered, 1u);
  EXPECT_EQ(receiver.tell("hold /in"), "-1");
  receiver.process().stop();
  for (int i = 0; i < 5000; ++i) EXPECT_EQ(out.publish(Number{i}).delivered, 1u);
  receiver.process().signal(SIGCONT);
  EXPECT_EQ(receiver.tell("held /in"), "-1");
  EXPECT_EQ(receiver.tell("give /in"), "done");
  EXPECT_EQ(receiver.tell("take /in"), "4996");
}

TEST(Deaths, AStoppedPublisherHoldsUpNoReceiver) {
  Daemon daemon(override_model());
  Component high("high");
  ASSERT_EQ(high.tell("output /high"), "open");
  Node node("test");
  auto low = node.output_port<Number>("/low");
  auto in = node.input_port<Number>("/in");
  high.begin("publish /high 0 1000000000");
  for (int i = 0; i < 20; ++i) {
    EXPECT_TRUE(in.wait_for(std::chrono::hours::max()));
    high.process().stop();
    while (in.take()) {
    }
    EXPECT_EQ(low.publish(Number{1}).discarded, 1u);
    high.process().signal(SIGCONT);
  }
}

TEST(Deaths, WithoutADaemonDataFlowsOn) {
  Daemon daemon(override_model());
  Component sender("sender");
  ASSERT_EQ(sender.tell("output /high"), "open");
  Node node("test");
  auto low = node.output_port<Number>("/low");
  auto in = node.input_port<Number>("/in");
  hear_all(sender);
  daemon.kill();
  EXPECT_EQ(low.publish(Number{1}).delivered, 1u);
  EXPECT_EQ(take_from(in), 1);
  EXPECT_EQ(low.publish(Number{2}).delivered, 1u);
  EXPECT_EQ(sender.tell("publish /high 3"), "1 0 0");
  EXPECT_EQ(take_from(in), 3) << "and is arbitrated";
  for (int i = 0; i < 1000; ++i) {
    EXPECT_EQ(sender.tell("publish /high " + std::to_string(i)), "1 0 0");
    EXPECT_EQ(take_from(in), i);
  }
}

TEST(Deaths, APortThatWasClosedIsFreeForItsOwnComponentAndForTheNext) {
  Daemon daemon(single_model());
  Node node("test");
  auto in = node.input_port<Number>("/in");
  for (int i = 0; i < 5; ++i) {
    Component sender("sender");
    ASSERT_EQ(sender.tell("output /out"), "open");
    EXPECT_EQ(sender.tell("publish /out 1 1"), "1 0 0");
    EXPECT_EQ(sender.tell("close /out"), "closed");
    ASSERT_EQ(sender.tell("output /out"), "open") << "its own name, closed a moment ago";
    EXPECT_EQ(sender.tell("publish /out 2 1"), "1 0 0");
    EXPECT_EQ(take_from(in), 1);
    EXPECT_EQ(take_from(in), 2);
    sender.process().signal(SIGTERM);
    sender.process().wait();
  }
}

// The library's own static objects are made after those of a program that is linked with it, and
// are gone before them.
TEST(Deaths, NodesThatAreStaticObjectsEndUnheardWithTheirProcess) {
  Daemon daemon(single_model());
  Component component("test");
  ASSERT_EQ(component.tell("static-node one"), "done");
  ASSERT_EQ(component.tell("static-node two"), "done");
  daemon.kill();
  EXPECT_EQ(component.end(), 0);
}

}  // namespace
}  // namespace arbiter::test
