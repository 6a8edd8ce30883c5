// A new model comes into force while components run.
#include <gtest/gtest.h>

#include <atomic>
#include <thread>

#include <arbiter/arbiter.hpp>

#include "tests/client/component.hpp"
#include "tests/client/models.hpp"
#include "tests/client/samples.hpp"
#include "tests/support/daemon.hpp"
#include "tests/support/hear_all.hpp"

namespace arbiter::test {
namespace {

// Puts a model in force, and lets the node hear of it.
void load(Daemon& daemon, Node& node, const std::string& model) {
  daemon.load(model);
  hear_all(node);
}

TEST(Swap, DeliveriesFollowTheNewModelOnceItIsInForce) {
  Daemon daemon(only("a"));
  Node node("test");
  auto a = node.output_port<Number>("/a");
  auto b = node.output_port<Number>("/b");
  auto in = node.input_port<Number>("/in");
  for (int i = 0; i < 20; ++i) {
    EXPECT_EQ(a.publish(Number{1}).delivered, 1u);
    EXPECT_EQ(take_from(in), 1);
    EXPECT_EQ(b.publish(Number{2}).delivered, 0u);
    EXPECT_FALSE(in.take());
    load(daemon, node, only("b"));
    EXPECT_EQ(a.publish(Number{3}).delivered, 0u);
    EXPECT_FALSE(in.take());
    EXPECT_EQ(b.publish(Number{4}).delivered, 1u);
    EXPECT_EQ(take_from(in), 4);
    load(daemon, node, only("a"));
  }
}

TEST(Swap, WhatWaitsForAConnectionThatIsGoneIsNotTaken) {
  Daemon daemon(only("a"));
  Node node("test");
  auto a = node.output_port<Number>("/a");
  auto in = node.input_port<Number>("/in");
  a.publish(Number{1});
  load(daemon, node, only("b"));
  EXPECT_FALSE(in.take());
  load(daemon, node, only("a"));
  EXPECT_FALSE(in.take()) << "nor when the connection comes again";
  EXPECT_EQ(a.publish(Number{2}).delivered, 1u);
  EXPECT_EQ(take_from(in), 2);
}

// Neither end looks between the two swaps, so neither has seen the connection go.
TEST(Swap, AConnectionThatGoesAndComesAgainUnseenDeliversNothingTwiceAndLosesNothingNew) {
  Daemon daemon(only("a"));
  Node node("test");
  auto a = node.output_port<Number>("/a");
  auto in = node.input_port<Number>("/in", {.depth = 4});
  std::int64_t value = 0;
  for (int round = 0; round < 20; ++round) {
    for (int i = 0; i <= round % 5; ++i) a.publish(Number{++value});
    auto sample = in.take();
    ASSERT_TRUE(sample) << round;
    sample.reset();
    while (in.take()) {
    }
    load(daemon, node, only("b"));
    if (round % 2 == 1) {
      EXPECT_EQ(a.publish(Number{++value}).delivered, 0u);
    }
    load(daemon, node, only("a"));
    ASSERT_FALSE(in.take()) << round;
    for (int i = 0; i < 6; ++i) {
      ASSERT_EQ(a.publish(Number{++value}).delivered, 1u) << round;
      auto next = in.take();
      ASSERT_TRUE(next) << round;
      ASSERT_EQ((**next).value, value) << round;
    }
  }
}

TEST(Swap, ASampleThatIsHeldSurvivesTheEndOfItsConnection) {
  Daemon daemon(only("a"));
  Node node("test");
  auto a = node.output_port<Number>("/a");
  auto b = node.output_port<Number>("/b");
  auto in = node.input_port<Number>("/in", {.depth = 2, .max_held = 3});
  a.publish(Number{-1});
  auto first = in.take();
  load(daemon, node, only("b"));
  b.publish(Number{-2});
  auto second = in.take();
  load(daemon, node, only("a"));
  a.publish(Number{-3});
  auto third = in.take();
  for (int i = 0; i < 1000; ++i) {
    a.publish(Number{i});
    b.publish(Number{i});
  }
  EXPECT_EQ((**first).value, -1);
  EXPECT_EQ((**second).value, -2);
  EXPECT_EQ((**third).value, -3);
  EXPECT_EQ(first->source(), "/a");
  EXPECT_EQ(second->source(), "/b");
  first.reset();
  EXPECT_TRUE(in.take());
}

TEST(Swap, APortThatKeepsGetsNothingOverAConnectionThatIsGone) {
  Daemon daemon(only("a"));
  Node node("test");
  auto a = node.output_port<Number>("/a");
  auto in = node.input_port<Number>("/in", {.keep = true});
  a.publish(Number{1});
  load(daemon, node, only("b"));
  load(daemon, node, only("a"));
  a.publish(Number{2});
  EXPECT_EQ(take_from(in), 2);
}

TEST(Swap, ANewModelMayReadSourcesThatNobodyHasSeenBefore) {
  Daemon daemon(rules(arbiter_at("/in", select("/a"))));
  Node node("test");
  auto a = node.output_port<Number>("/a");
  auto in = node.input_port<Number>("/in");
  for (int i = 0; i < 30; ++i) {
    const std::string stop = "/stop" + std::to_string(i);
    load(daemon, node, rules(arbiter_at("/in", select("/a", "not " + stop))));
    auto brake = node.output_port<Number>(stop);
    EXPECT_EQ(a.publish(Number{i}).delivered, 1u);
    brake.signal();
    EXPECT_FALSE(in.take());
    EXPECT_EQ(a.publish(Number{i}).discarded, 1u);
  }
  EXPECT_EQ(daemon.input("/in")["blind"], 0);
}

// The node has no thread that would take up the page of the new source, so it holds back.
TEST(Swap, APortThatCannotSeeASourceOfItsRulesDeliversNothingAndCountsIt) {
  Daemon daemon(rules(arbiter_at("/in", select("/a"))));
  Node sender("sender");
  Node receiver("receiver", {.service_thread = false});
  auto in = receiver.input_port<Number>("/in");
  auto a = sender.output_port<Number>("/a");
  receiver.service();
  daemon.load(rules(arbiter_at("/in", select("/a", "not /new"))));
  hear_all(sender);
  EXPECT_EQ(a.publish(Number{1}).delivered, 1u) << "the publisher sees it";
  EXPECT_EQ(take_from(in), kNothing);
  EXPECT_EQ(daemon.input("/in")["blind"], 1);
  receiver.service();
  EXPECT_EQ(take_from(in), 1) << "held back, not lost";
}

TEST(Swap, APublisherThatCannotSeeASourceOfTheRulesDeliversNothingAndCountsIt) {
  Daemon daemon(rules(arbiter_at("/in", select("/a"))));
  Node sender("sender", {.service_thread = false});
  Node receiver("receiver");
  auto a = sender.output_port<Number>("/a");
  auto in = receiver.input_port<Number>("/in");
  sender.service();
  EXPECT_EQ(a.publish(Number{1}).delivered, 1u);
  daemon.load(rules(arbiter_at("/in", select("/a", "not /new"))));
  EXPECT_EQ(a.publish(Number{2}).discarded, 1u);
  EXPECT_EQ(daemon.source("/a")["blind"], 1);
  sender.service();
  EXPECT_EQ(a.publish(Number{3}).delivered, 1u);
}

TEST(Swap, ASensedSourceMayBecomeAConnectionAndBack) {
  const std::string sensed = rules(arbiter_at("/in", select("/low", "not /high")));
  Daemon daemon(sensed);
  Node node("test");
  auto low = node.output_port<Number>("/low");
  auto high = node.output_port<Number>("/high");
  auto in = node.input_port<Number>("/in");
  for (int i = 0; i < 10; ++i) {
    const Outcome outcome = high.publish(Number{1});
    EXPECT_EQ(outcome.delivered + outcome.discarded, 0u);
    EXPECT_EQ(low.publish(Number{2}).discarded, 1u);
    EXPECT_FALSE(in.take());
    load(daemon, node, override_model());
    EXPECT_EQ(high.publish(Number{3}).delivered, 1u);
    EXPECT_EQ(take_from(in), 3);
    load(daemon, node, sensed);
  }
}

// The model changes under a publisher and a receiver that run flat out. Each source says in its
// samples under which of two models it may deliver; what comes through must be whole and in order,
// and once a model is in force nothing that is published and taken afterwards is of the other.
TEST(Swap, UnderAPublisherAndAReceiverThatRunFlatOut) {
  Daemon daemon(only("a"));
  Component senders[2] = {Component("a"), Component("b")};
  ASSERT_EQ(senders[0].tell("output /a"), "open");
  ASSERT_EQ(senders[1].tell("output /b"), "open");
  Node node("test");
  auto in = node.input_port<Number>("/in", {.depth = 64, .max_held = 4});
  std::atomic<bool> stop{false};
  std::thread receiver([&] {
    std::uint64_t last[2] = {0, 0};
    while (!stop) {
      auto result = in.wait_for(std::chrono::milliseconds(1));
      if (!result) continue;
      const std::size_t from = result->source() == "/a" ? 0 : 1;
      ASSERT_GT(result->sequence(), last[from]);
      last[from] = result->sequence();
      const auto value = (**result).value;
      ASSERT_EQ(value / 1'000'000'000, from + 1);
    }
  });
  senders[0].begin("publish /a 1000000000 300000");
  senders[1].begin("publish /b 2000000000 300000");
  for (int i = 0; i < 40; ++i) daemon.load(only(i % 2 == 0 ? "b" : "a"));
  EXPECT_NE(senders[0].answer(), "dead");
  EXPECT_NE(senders[1].answer(), "dead");
  stop = true;
  receiver.join();
  hear_all(node);
  for (Component& sender : senders) hear_all(sender);
  while (in.take()) {
  }
  EXPECT_EQ(senders[0].tell("publish /a 1000000000"), "1 0 0");
  EXPECT_EQ(senders[1].tell("publish /b 2000000000"), "0 0 0");
  auto sample = in.take();
  ASSERT_TRUE(sample);
  EXPECT_EQ(sample->source(), "/a");
  EXPECT_FALSE(in.take());
  EXPECT_EQ(daemon.input("/in")["misbehaved"], 0);
}

TEST(Swap, APortThatTheNewModelDoesNotMentionStaysOpenAndGetsNothing) {
  Daemon daemon(only("a"));
  Node node("test");
  auto a = node.output_port<Number>("/a");
  auto in = node.input_port<Number>("/in");
  a.publish(Number{1});
  load(daemon, node, rules(arbiter_at("/elsewhere", select("/a"))));
  EXPECT_FALSE(in.take());
  const Outcome outcome = a.publish(Number{2});
  EXPECT_EQ(outcome.delivered + outcome.discarded, 0u);
  EXPECT_FALSE(in.take());
  const auto port = daemon.input("/in");
  EXPECT_EQ(port["open"], true);
  EXPECT_EQ(port["arbitrated"], false);
  EXPECT_TRUE(port["connections"].empty());
  load(daemon, node, only("a"));
  a.publish(Number{3});
  EXPECT_EQ(take_from(in), 3) << "and is as before when a model mentions it again";
}

// What the application connects is delivered, whoever else is active.
TEST(Swap, APortThatTheNewModelDoesNotMentionIsNoLongerArbitrated) {
  Daemon daemon(override_model(), {.application = application(connection("/low", "/in") +
                                                              connection("/high", "/in"))});
  Node node("test");
  auto low = node.output_port<Number>("/low");
  auto high = node.output_port<Number>("/high");
  auto in = node.input_port<Number>("/in");
  high.publish(Number{1});
  EXPECT_EQ(low.publish(Number{2}).discarded, 1u);
  EXPECT_EQ(take_from(in), 1);
  load(daemon, node, "<behaviors/>");
  EXPECT_EQ(low.publish(Number{3}).delivered, 1u);
  EXPECT_EQ(high.publish(Number{4}).delivered, 1u);
  EXPECT_EQ(daemon.input("/in")["arbitrated"], false);
  EXPECT_EQ(take_from(in), 3);
  EXPECT_EQ(take_from(in), 4);
  load(daemon, node, override_model());
  EXPECT_EQ(low.publish(Number{5}).discarded, 1u);
}

TEST(Swap, ABadModelChangesNothing) {
  Daemon daemon(only("a"));
  Node node("test");
  auto a = node.output_port<Number>("/a");
  auto in = node.input_port<Number>("/in");
  const auto generation = daemon.generation();
  a.publish(Number{1});
  for (const std::string bad :
       {"", "<behaviors", "<behaviors><nonsense/></behaviors>", "<behaviors timeout='0s'/>"}) {
    daemon.load_bad(bad);
  }
  EXPECT_EQ(daemon.generation(), generation);
  EXPECT_EQ(take_from(in), 1);
  EXPECT_EQ(a.publish(Number{2}).delivered, 1u);
  load(daemon, node, only("b"));
  EXPECT_EQ(a.publish(Number{3}).delivered, 0u);
}

TEST(Swap, ManyReloadsInARowEndWithTheLast) {
  Daemon daemon(only("a"));
  Node node("test");
  auto b = node.output_port<Number>("/b");
  auto in = node.input_port<Number>("/in");
  daemon.write_model(only("b"));
  for (int i = 0; i < 100; ++i) daemon.hang_up();
  load(daemon, node, only("b"));
  EXPECT_EQ(b.publish(Number{1}).delivered, 1u);
  EXPECT_EQ(take_from(in), 1);
}

}  // namespace
}  // namespace arbiter::test
