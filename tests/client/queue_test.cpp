// The queue of each connection: its depth, what gives way, and who can still be read.
#include <gtest/gtest.h>

#include <string>

#include <arbiter/arbiter.hpp>

#include "tests/client/component.hpp"
#include "tests/client/models.hpp"
#include "tests/client/samples.hpp"
#include "tests/support/daemon.hpp"

namespace arbiter::test {
namespace {

TEST(Queue, TheOldestSampleGivesWayWhenItIsFull) {
  Daemon daemon(single_model());
  Node node("test");
  auto out = node.output_port<Number>("/out");
  auto in = node.input_port<Number>("/in", {.depth = 4});
  for (int i = 1; i <= 10; ++i) EXPECT_EQ(out.publish(Number{i}).delivered, 1u);
  EXPECT_EQ(take_all(in), (std::vector<std::int64_t>{7, 8, 9, 10}));
  const auto connection = daemon.connection("/out", "/in");
  EXPECT_EQ(connection["accepted"], 10);
  EXPECT_EQ(connection["overtaken"], 6);
  EXPECT_EQ(connection["taken"], 4);
  EXPECT_EQ(connection["waiting"], 0);
}

TEST(Queue, OneThatRefusesTellsThePublisher) {
  Daemon daemon(single_model());
  Node node("test");
  auto out = node.output_port<Number>("/out");
  auto in = node.input_port<Number>("/in", {.depth = 3, .when_full = refuse_new});
  for (int i = 1; i <= 3; ++i) EXPECT_EQ(out.publish(Number{i}).delivered, 1u);
  for (int i = 4; i <= 5; ++i) {
    const Outcome outcome = out.publish(Number{i});
    EXPECT_EQ(outcome.delivered, 0u);
    EXPECT_EQ(outcome.discarded, 0u);
    EXPECT_EQ(outcome.refused, 1u);
  }
  EXPECT_EQ(take_from(in), 1);
  EXPECT_EQ(out.publish(Number{6}).delivered, 1u);
  EXPECT_EQ(out.publish(Number{7}).refused, 1u);
  EXPECT_EQ(take_all(in), (std::vector<std::int64_t>{2, 3, 6}));
  const auto connection = daemon.connection("/out", "/in");
  EXPECT_EQ(connection["accepted"], 4);
  EXPECT_EQ(connection["refused"], 3);
}

TEST(Queue, OneThatRefusesTakesAgainWhatWasDroppedAtTheTake) {
  Daemon daemon(override_model());
  Node node("test");
  auto low = node.output_port<Number>("/low");
  auto stop = node.output_port<Number>("/stop");
  auto in = node.input_port<Number>("/in", {.depth = 2, .when_full = refuse_new});
  for (int i = 1; i <= 2; ++i) EXPECT_EQ(low.publish(Number{i}).delivered, 1u);
  EXPECT_EQ(low.publish(Number{3}).refused, 1u);
  stop.signal();
  EXPECT_FALSE(in.take());
  stop.deactivate();
  EXPECT_EQ(low.publish(Number{4}).delivered, 1u);
  EXPECT_EQ(take_all(in), std::vector<std::int64_t>{4});
}

TEST(Queue, EachReceiverHasADepthOfItsOwn) {
  Daemon daemon(fan_out_model(4));
  Node node("test");
  auto out = node.output_port<Number>("/out");
  auto one = node.input_port<Number>("/in0", {.depth = 1});
  auto five = node.input_port<Number>("/in1", {.depth = 5});
  auto refusing = node.input_port<Number>("/in2", {.depth = 2, .when_full = refuse_new});
  auto all = node.input_port<Number>("/in3", {.depth = 1024});
  std::uint32_t delivered = 0;
  std::uint32_t refused = 0;
  for (int i = 1; i <= 20; ++i) {
    const Outcome outcome = out.publish(Number{i});
    delivered += outcome.delivered;
    refused += outcome.refused;
  }
  EXPECT_EQ(delivered, 3u * 20 + 2);
  EXPECT_EQ(refused, 18u);
  EXPECT_EQ(take_all(one), std::vector<std::int64_t>{20});
  EXPECT_EQ(take_all(five), (std::vector<std::int64_t>{16, 17, 18, 19, 20}));
  EXPECT_EQ(take_all(refusing), (std::vector<std::int64_t>{1, 2}));
  EXPECT_EQ(take_all(all).size(), 20u);
  EXPECT_EQ(daemon.connection("/out", "/in0")["overtaken"], 19);
  EXPECT_EQ(daemon.connection("/out", "/in1")["overtaken"], 15);
  EXPECT_EQ(daemon.connection("/out", "/in3")["overtaken"], 0);
}

TEST(Queue, TheDepthIsThatOfEachConnection) {
  Daemon daemon("", {.application = application(connection("/a", "/in") + connection("/b", "/in")),
                     .without_model = true});
  Node node("test");
  auto a = node.output_port<Number>("/a");
  auto b = node.output_port<Number>("/b");
  auto in = node.input_port<Number>("/in", {.depth = 2});
  for (int i = 0; i < 10; ++i) a.publish(Number{i});
  for (int i = 10; i < 20; ++i) b.publish(Number{i});
  EXPECT_EQ(take_all(in), (std::vector<std::int64_t>{8, 9, 18, 19}));
}

TEST(Queue, WhatAPublisherDeliveredBeforeItClosedCanStillBeTaken) {
  Daemon daemon(single_model());
  Node node("test");
  auto in = node.input_port<Number>("/in");
  {
    auto out = node.output_port<Number>("/out");
    for (int i = 1; i <= 3; ++i) out.publish(Number{i});
  }
  EXPECT_EQ(take_all(in), (std::vector<std::int64_t>{1, 2, 3}));
}

TEST(Queue, WhatAPublisherDeliveredBeforeItWasKilledCanStillBeTaken) {
  Daemon daemon(single_model());
  Node node("test");
  auto in = node.input_port<Number>("/in");
  Component sender("sender");
  ASSERT_EQ(sender.tell("output /out"), "open");
  EXPECT_EQ(sender.tell("publish /out 1 3"), "1 0 0");
  sender.kill();
  EXPECT_EQ(take_all(in), (std::vector<std::int64_t>{1, 2, 3}));
}

TEST(Queue, ASuccessorsSamplesComeBehindItsPredecessors) {
  Daemon daemon(single_model());
  Node node("test");
  auto in = node.input_port<Number>("/in", {.depth = 4});
  for (int generation = 0; generation < 3; ++generation) {
    Component sender("sender");
    ASSERT_EQ(sender.tell("output /out"), "open");
    EXPECT_EQ(sender.tell("publish /out " + std::to_string(10 * generation) + " 2"), "1 0 0");
    sender.kill();
  }
  EXPECT_EQ(take_all(in), (std::vector<std::int64_t>{10, 11, 20, 21})) << "at most `depth` of them";
}

TEST(Queue, AnOverrideDropsWhatADeadPublisherLeft) {
  Daemon daemon(override_model());
  Node node("test");
  auto in = node.input_port<Number>("/in");
  auto stop = node.output_port<Number>("/stop");
  Component sender("sender");
  ASSERT_EQ(sender.tell("output /low"), "open");
  EXPECT_EQ(sender.tell("publish /low 1 3"), "1 0 0");
  sender.kill();
  stop.signal();
  EXPECT_FALSE(in.take());
  stop.deactivate();
  EXPECT_FALSE(in.take());
  EXPECT_EQ(daemon.input("/in")["dropped"], 3);
}

// Also by a receiver that looks at its queue before it hears that it has ended.
TEST(Queue, WhatWaitsWhenAnotherModelEndsItIsCounted) {
  for (const bool comes_back : {false, true}) {
    for (const bool looks_first : {false, true}) {
      for (const int samples : {3, 6}) {
        Daemon daemon(single_model());
        NodeOptions options;
        options.service_thread = false;
        Node node("receiver", options);
        auto in = node.input_port<Number>("/in", {.depth = 4});
        Component sender("sender");
        ASSERT_EQ(sender.tell("output /out"), "open");
        node.service();
        EXPECT_EQ(sender.tell("publish /out 1"), "1 0 0");
        EXPECT_EQ(take_from(in), 1);
        EXPECT_EQ(sender.tell("publish /out 1 " + std::to_string(samples)), "1 0 0");
        daemon.load(only("other"));
        sender.tell("publish /out 1");  // takes it up
        if (comes_back) daemon.load(single_model());
        sender.tell("publish /out 1");
        if (looks_first) static_cast<void>(in.take());
        node.service();
        while (in.take()) {
        }
        const auto counted = daemon.input("/in");
        const int all = counted["taken"].get<int>() + counted["dropped"].get<int>() +
                        counted["overtaken"].get<int>();
        EXPECT_EQ(daemon.source("/out")["delivered"], all) << counted;
      }
    }
  }
}

// Each new receiver gets what is published from its coming on, whoever had its place before.
TEST(Queue, ANewReceiverGetsNothingOfItsPredecessors) {
  Daemon daemon(single_model());
  Node node("test");
  auto out = node.output_port<Number>("/out");
  for (int generation = 0; generation < 5; ++generation) {
    auto in = node.input_port<Number>("/in", {.depth = 8u - static_cast<unsigned>(generation)});
    EXPECT_FALSE(in.take());
    for (int i = 0; i < 3; ++i) out.publish(Number{10 * generation + i});
    EXPECT_EQ(take_from(in), 10 * generation);
    for (int i = 3; i < 6; ++i) out.publish(Number{10 * generation + i});
  }
  auto in = node.input_port<Number>("/in");
  EXPECT_FALSE(in.take());
  out.publish(Number{99});
  EXPECT_EQ(take_all(in), std::vector<std::int64_t>{99});
}

TEST(Queue, AReceiverThatDiedHoldingSamplesLosesThemNoMemory) {
  Daemon daemon(single_model());
  Node node("test", {.service_thread = false});  // takes up its receivers when it is told to
  auto out = node.output_port<Number>("/out");
  for (int generation = 0; generation < 20; ++generation) {
    Component receiver("receiver");
    ASSERT_EQ(receiver.tell("input /in 8 1 0"), "open");
    node.service();
    for (int i = 0; i < 20; ++i) EXPECT_EQ(out.publish(Number{i}).delivered, 1u);
    EXPECT_EQ(receiver.tell("hold /in"), "12");
    receiver.kill();
  }
  EXPECT_EQ(daemon.source("/out")["no_slot"], 0);
  EXPECT_EQ(daemon.source("/out")["delivered"], 400);
}

TEST(Queue, APublisherWithLittleMemoryGivesSmallerQueues) {
  Daemon daemon(fan_out_model(2));
  Node node("test");
  OutputPortOptions options;
  options.max_memory = 10 * 64;  // ten samples: 3 for itself, 1 to be held
  auto out = node.output_port<Number>("/out", options);
  auto in = node.input_port<Number>("/in0", {.depth = 100});
  for (int i = 1; i <= 100; ++i) EXPECT_EQ(out.publish(Number{i}).delivered, 1u);
  const auto held = in.take();
  EXPECT_EQ((**held).value, 95);
  for (int i = 101; i <= 200; ++i) EXPECT_EQ(out.publish(Number{i}).delivered, 1u);
  EXPECT_EQ((**held).value, 95);
  auto other = node.input_port<Number>("/in1", {.depth = 100});
  EXPECT_NE(daemon.connection("/out", "/in1")["mismatch"].dump().find("max_memory"),
            std::string::npos);
  EXPECT_EQ(out.publish(Number{201}).delivered, 1u);
  EXPECT_FALSE(other.take());
}

}  // namespace
}  // namespace arbiter::test
