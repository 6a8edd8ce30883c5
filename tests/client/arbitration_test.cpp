// Who gets through, live, at both ends: publish() and take().
#include <gtest/gtest.h>

#include <arbiter/arbiter.hpp>

#include "tests/client/component.hpp"
#include "tests/client/models.hpp"
#include "tests/client/samples.hpp"
#include "tests/support/daemon.hpp"

namespace arbiter::test {
namespace {

TEST(Arbitration, TheWinnerDeliversAndTheLoserIsDiscarded) {
  Daemon daemon(override_model());
  Node node("test");
  auto low = node.output_port<Number>("/low");
  auto high = node.output_port<Number>("/high");
  auto in = node.input_port<Number>("/in");
  const Outcome won = high.publish(Number{1});
  EXPECT_EQ(won.delivered, 1u);
  EXPECT_EQ(won.discarded, 0u);
  const Outcome lost = low.publish(Number{2});
  EXPECT_EQ(lost.delivered, 0u);
  EXPECT_EQ(lost.discarded, 1u);
  auto sample = in.take();
  ASSERT_TRUE(sample);
  EXPECT_EQ((**sample).value, 1);
  EXPECT_EQ(sample->source(), "/high");
  EXPECT_EQ(sample->sequence(), 1u);
  EXPECT_FALSE(in.take());
}

TEST(Arbitration, AnOverrideCountsFromTheFirstSampleOfASourceThatHasOnlyJustBeenOpened) {
  Daemon daemon(override_model());
  Node node("test");
  auto low = node.output_port<Number>("/low");
  auto in = node.input_port<Number>("/in");
  EXPECT_EQ(low.publish(Number{1}).delivered, 1u);
  auto high = node.output_port<Number>("/high");
  high.publish(Number{2});
  auto sample = in.take();
  ASSERT_TRUE(sample);
  EXPECT_EQ((**sample).value, 2);
}

TEST(Arbitration, AnOverrideCountsFromTheFirstSignalOfAComponentThatHasOnlyJustBeenStarted) {
  Daemon daemon(override_model());
  Node node("test");
  auto low = node.output_port<Number>("/low");
  auto in = node.input_port<Number>("/in");
  EXPECT_EQ(low.publish(Number{1}).delivered, 1u);
  Component brake("brake");
  ASSERT_EQ(brake.tell("output /stop"), "open");
  brake.tell("signal /stop");
  EXPECT_FALSE(in.take());
  EXPECT_TRUE(in.idle());
}

TEST(Arbitration, WhatWaitsIsDroppedAtTheTakeAfterAnOverrideAndCountedApart) {
  Daemon daemon(override_model());
  Node node("test");
  auto low = node.output_port<Number>("/low");
  auto high = node.output_port<Number>("/high");
  auto in = node.input_port<Number>("/in");
  for (int i = 0; i < 3; ++i) EXPECT_EQ(low.publish(Number{i}).delivered, 1u);
  high.signal();
  EXPECT_FALSE(in.take());
  high.deactivate();
  EXPECT_FALSE(in.take()) << "dropped is dropped";
  const auto connection = daemon.connection("/low", "/in");
  EXPECT_EQ(connection["accepted"], 3);
  EXPECT_EQ(connection["dropped"], 3);
  EXPECT_EQ(connection["discarded"], 0);
  EXPECT_EQ(connection["taken"], 0);
  EXPECT_EQ(daemon.input("/in")["dropped"], 3);
}

TEST(Arbitration, AnOverrideThatIsOverBeforeTheTakeDropsNothing) {
  Daemon daemon(override_model());
  Node node("test");
  auto low = node.output_port<Number>("/low");
  auto high = node.output_port<Number>("/high");
  auto in = node.input_port<Number>("/in");
  low.publish(Number{1});
  high.signal();
  high.deactivate();
  auto sample = in.take();
  ASSERT_TRUE(sample);
  EXPECT_EQ((**sample).value, 1);
}

TEST(Arbitration, APortThatKeepsReceivesAllThatWasAccepted) {
  Daemon daemon(override_model());
  Node node("test");
  auto low = node.output_port<Number>("/low");
  auto high = node.output_port<Number>("/high");
  auto in = node.input_port<Number>("/in", {.keep = true});
  low.publish(Number{1});
  low.publish(Number{2});
  high.signal();
  EXPECT_EQ(low.publish(Number{3}).discarded, 1u) << "it keeps what was accepted, no more";
  EXPECT_EQ(take_from(in), 1);
  EXPECT_EQ(take_from(in), 2);
  EXPECT_FALSE(in.take());
  EXPECT_EQ(daemon.input("/in")["dropped"], 0);
}

TEST(Arbitration, ASensedSourceSilencesWithoutAConnection) {
  Daemon daemon(override_model());
  Node node("test");
  auto low = node.output_port<Number>("/low");
  auto stop = node.output_port<Number>("/stop");
  auto in = node.input_port<Number>("/in");
  const Outcome outcome = stop.publish(Number{1});
  EXPECT_EQ(outcome.delivered, 0u);
  EXPECT_EQ(outcome.discarded, 0u) << "a port that only senses it is not counted";
  EXPECT_EQ(low.publish(Number{2}).discarded, 1u);
  EXPECT_FALSE(in.take());
  EXPECT_EQ(in.winner(), std::nullopt);
  stop.deactivate();
  EXPECT_EQ(low.publish(Number{3}).delivered, 1u);
}

TEST(Arbitration, APortThatNoRuleMentionsGetsEverything) {
  Daemon daemon(
      override_model(),
      {.application = application(connection("/low", "/in") + connection("/high", "/in") +
                                  connection("/low", "/log") + connection("/high", "/log"))});
  Node node("test");
  auto low = node.output_port<Number>("/low");
  auto high = node.output_port<Number>("/high");
  auto in = node.input_port<Number>("/in");
  auto log = node.input_port<Number>("/log");
  EXPECT_EQ(high.publish(Number{1}).delivered, 2u);
  const Outcome outcome = low.publish(Number{2});
  EXPECT_EQ(outcome.delivered, 1u);
  EXPECT_EQ(outcome.discarded, 1u);
  EXPECT_EQ(take_from(log), 1);
  EXPECT_EQ(take_from(log), 2);
  EXPECT_EQ(log.winner(), std::nullopt) << "nothing is selected at a port without an arbiter";
  EXPECT_FALSE(log.idle());
  EXPECT_FALSE(daemon.input("/log")["arbitrated"]);
}

TEST(Arbitration, AConnectionWithoutARuleNeverDeliversButItsActivityIsSeen) {
  Daemon daemon(
      rules(arbiter_at("/in", select("/low", "not /other"))),
      {.application = application(connection("/low", "/in") + connection("/other", "/in"))});
  Node node("test");
  auto low = node.output_port<Number>("/low");
  auto other = node.output_port<Number>("/other");
  auto in = node.input_port<Number>("/in");
  EXPECT_EQ(low.publish(Number{1}).delivered, 1u);
  const Outcome outcome = other.publish(Number{2});
  EXPECT_EQ(outcome.delivered, 0u);
  EXPECT_EQ(outcome.discarded, 1u);
  EXPECT_FALSE(in.take()) << "the first sample has been overridden";
  EXPECT_EQ(low.publish(Number{3}).discarded, 1u);
}

TEST(Arbitration, WithoutAModelThereAreNoConnections) {
  Daemon daemon("", {.without_model = true});
  Node node("test");
  auto out = node.output_port<Number>("/out");
  auto in = node.input_port<Number>("/in");
  const Outcome outcome = out.publish(Number{1});
  EXPECT_EQ(outcome.delivered + outcome.discarded + outcome.refused, 0u);
  EXPECT_FALSE(in.take());
  EXPECT_TRUE(in.idle());
}

TEST(Arbitration, AnApplicationAloneConnectsWithoutAnArbiter) {
  Daemon daemon("", {.application = application(connection("/out", "/in")), .without_model = true});
  Node node("test");
  auto out = node.output_port<Number>("/out");
  auto in = node.input_port<Number>("/in");
  EXPECT_EQ(out.publish(Number{1}).delivered, 1u);
  EXPECT_EQ(take_from(in), 1);
}

TEST(Arbitration, SamplesOfOneSourceComeInTheOrderInWhichTheyWerePublished) {
  Daemon daemon(single_model());
  Node node("test");
  auto out = node.output_port<Number>("/out");
  auto in = node.input_port<Number>("/in", {.depth = 100});
  for (int i = 1; i <= 100; ++i) out.publish(Number{i});
  for (int i = 1; i <= 100; ++i) {
    auto sample = in.take();
    ASSERT_TRUE(sample);
    EXPECT_EQ((**sample).value, i);
    EXPECT_EQ(sample->sequence(), static_cast<std::uint64_t>(i));
  }
  EXPECT_FALSE(in.take());
}

TEST(Arbitration, SamplesOfSeveralSourcesComeInTheOrderOfTheirArrival) {
  Daemon daemon("", {.application = application(connection("/a", "/in") + connection("/b", "/in") +
                                                connection("/c", "/in")),
                     .without_model = true});
  Node node("test");
  std::vector<OutputPort<Number>> outputs;
  for (const char* name : {"/a", "/b", "/c"}) outputs.push_back(node.output_port<Number>(name));
  auto in = node.input_port<Number>("/in", {.depth = 64});
  std::uint32_t random = 1;
  for (int i = 0; i < 60; ++i) {
    random = random * 1664525u + 1013904223u;
    outputs[random >> 16 & 1 ? 0 : 1 + (random >> 20 & 1)].publish(Number{i});
  }
  for (int i = 0; i < 60; ++i) {
    auto sample = in.take();
    ASSERT_TRUE(sample);
    EXPECT_EQ((**sample).value, i);
  }
}

TEST(Arbitration, ASampleTellsWhenItArrived) {
  Daemon daemon(single_model());
  Node node("test");
  auto out = node.output_port<Number>("/out");
  auto in = node.input_port<Number>("/in");
  const auto before = std::chrono::steady_clock::now().time_since_epoch().count();
  out.publish(Number{1});
  const auto after = std::chrono::steady_clock::now().time_since_epoch().count();
  auto sample = in.take();
  ASSERT_TRUE(sample);
  EXPECT_LE(before, sample->stamp_ns());
  EXPECT_LE(sample->stamp_ns(), after);
}

TEST(Arbitration, OneSourceWinsAtOnePortAndLosesAtAnother) {
  Daemon daemon(rules(arbiter_at("/gaze", select("/face")) +
                      arbiter_at("/arm", select("/face", "not /stop"))));
  Node node("test");
  auto face = node.output_port<Number>("/face");
  auto stop = node.output_port<Number>("/stop");
  auto gaze = node.input_port<Number>("/gaze");
  auto arm = node.input_port<Number>("/arm");
  stop.signal();
  const Outcome outcome = face.publish(Number{1});
  EXPECT_EQ(outcome.delivered, 1u);
  EXPECT_EQ(outcome.discarded, 1u);
  EXPECT_TRUE(gaze.take());
  EXPECT_FALSE(arm.take());
}

TEST(Arbitration, ARuleThatIsNoConjunctionIsDecidedToo) {
  Daemon daemon(rules(arbiter_at("/in", select("/out", "/a and /b or not /a and /c"))));
  Node node("test");
  auto out = node.output_port<Number>("/out");
  auto a = node.output_port<Number>("/a");
  auto b = node.output_port<Number>("/b");
  auto c = node.output_port<Number>("/c");
  auto in = node.input_port<Number>("/in");
  for (int mask = 0; mask < 8; ++mask) {
    (mask & 1) != 0 ? static_cast<void>(a.signal()) : a.deactivate();
    (mask & 2) != 0 ? static_cast<void>(b.signal()) : b.deactivate();
    (mask & 4) != 0 ? static_cast<void>(c.signal()) : c.deactivate();
    const bool wins = (mask & 1) != 0 ? (mask & 2) != 0 : (mask & 4) != 0;
    EXPECT_EQ(out.publish(Number{mask}).delivered, wins ? 1u : 0u) << mask;
    EXPECT_EQ(in.take().has_value(), wins) << mask;
    EXPECT_EQ(in.idle(), !wins) << mask;
  }
}

}  // namespace
}  // namespace arbiter::test
