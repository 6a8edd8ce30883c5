// Samples that are made only where they are wanted: wants_samples() and publish_signalled().
#include <gtest/gtest.h>

#include <optional>
#include <utility>

#include <arbiter/arbiter.hpp>

#include "tests/client/models.hpp"
#include "tests/client/samples.hpp"
#include "tests/support/daemon.hpp"

namespace arbiter::test {
namespace {

constexpr Time kAnyTime = Time::max();

Loan<Number> loan_with(OutputPort<Number>& port, std::int64_t value) {
  auto loan = port.loan();
  **loan = Number{value};
  return std::move(*loan);
}

Time clock_now() { return std::chrono::steady_clock::now(); }

TEST(Signalled, ALoserWantsNoSamplesAndAWinnerDoes) {
  Daemon daemon(override_model());
  Node node("test");
  auto low = node.output_port<Number>("/low");
  auto high = node.output_port<Number>("/high");
  low.signal();
  EXPECT_FALSE(low.wants_samples()) << "the port is not open";
  auto in = node.input_port<Number>("/in");
  low.signal();
  EXPECT_TRUE(low.wants_samples());
  high.signal();
  low.publish(Number{1});
  EXPECT_FALSE(low.wants_samples());
  EXPECT_TRUE(high.wants_samples());
}

TEST(Signalled, APortThatKeepsWantsALosersSamplesToo) {
  Daemon daemon(override_model());
  Node node("test");
  auto low = node.output_port<Number>("/low");
  auto high = node.output_port<Number>("/high");
  InputPortOptions options;
  options.keep = true;
  auto in = node.input_port<Number>("/in", options);
  high.signal();
  low.signal();
  EXPECT_TRUE(low.wants_samples());
}

TEST(Signalled, ATapWantsThemIfItReadsSamples) {
  Daemon daemon(override_model());
  Node node("test");
  auto low = node.output_port<Number>("/low");
  auto high = node.output_port<Number>("/high");
  auto in = node.input_port<Number>("/in");
  high.signal();
  TapOptions without;
  without.max_held = 0;
  auto counting = node.tap("/low", without);
  low.signal();
  EXPECT_FALSE(low.wants_samples());
  auto reading = node.tap("/low");
  low.signal();
  EXPECT_TRUE(low.wants_samples());
}

TEST(Signalled, TheSampleIsHandedOverAndIsNoOtherArrival) {
  Daemon daemon(override_model("1000s"));
  Node node("test");
  auto low = node.output_port<Number>("/low");
  auto in = node.input_port<Number>("/in");
  auto tap = node.tap("/low");
  const Time before = clock_now();
  low.signal();
  const Time after = clock_now();
  EXPECT_EQ(low.publish_signalled(loan_with(low, 7), kAnyTime).delivered, 1U);
  const auto sample = in.take();
  ASSERT_TRUE(sample);
  EXPECT_EQ((*sample)->value, 7);
  EXPECT_EQ(sample->sequence(), 1U);
  const Time stamp{std::chrono::nanoseconds(sample->stamp_ns())};
  EXPECT_GE(stamp, before);
  EXPECT_LE(stamp, after) << "the signal's time";
  std::optional<Time> ends;
  int arrivals = 0;
  while (const auto event = tap.take()) {
    if (event->kind() != TapEventKind::signal && event->kind() != TapEventKind::sample) continue;
    if (++arrivals == 1) ends = event->active_until();
    EXPECT_EQ(event->time(), stamp);
    EXPECT_EQ(event->active_until(), ends) << "activity stays as it was";
  }
  EXPECT_EQ(arrivals, 2) << "the tap sees the sample, too";
}

TEST(Signalled, ALosersIsDiscarded) {
  Daemon daemon(override_model());
  Node node("test");
  auto low = node.output_port<Number>("/low");
  auto high = node.output_port<Number>("/high");
  auto in = node.input_port<Number>("/in");
  low.signal();
  high.signal();
  const Outcome outcome = low.publish_signalled(loan_with(low, 1), kAnyTime);
  EXPECT_EQ(outcome.delivered, 0U);
  EXPECT_EQ(outcome.discarded, 1U) << "overridden since its signal";
  EXPECT_FALSE(in.take());
}

TEST(Signalled, ItIsNeverLate) {
  Daemon daemon(override_model());
  Node node("test");
  auto low = node.output_port<Number>("/low", {.max_loans = 1});
  auto in = node.input_port<Number>("/in");
  EXPECT_TRUE(low.publish_signalled(loan_with(low, 1), kAnyTime).late) << "nothing has arrived";
  low.signal();
  EXPECT_TRUE(low.publish_signalled(loan_with(low, 2), Time{}).late) << "its deadline has passed";
  low.deactivate();
  EXPECT_TRUE(low.publish_signalled(loan_with(low, 3), kAnyTime).late);
  EXPECT_FALSE(daemon.source("/low")["active"]) << "nothing brings it back";
  EXPECT_FALSE(in.take());
  low.signal();
  EXPECT_EQ(low.publish_signalled(loan_with(low, 4), kAnyTime).delivered, 1U)
      << "each loan was free";
}

// As output_port.hpp says.
TEST(Signalled, ASecondOneIsOneMoreSampleOfTheSameArrival) {
  Daemon daemon(single_model("1000s"));
  Node node("test");
  auto out = node.output_port<Number>("/out");
  auto in = node.input_port<Number>("/in", {.max_held = 3});
  out.signal();
  EXPECT_EQ(out.publish_signalled(loan_with(out, 1), kAnyTime).delivered, 1U);
  EXPECT_EQ(out.publish_signalled(loan_with(out, 2), kAnyTime).delivered, 1U);
  const auto first = in.take();
  const auto second = in.take();
  ASSERT_TRUE(first && second);
  EXPECT_EQ(second->stamp_ns(), first->stamp_ns());
  EXPECT_EQ(first->sequence(), 1U);
  EXPECT_EQ(second->sequence(), 2U);
  out.publish(Number{3});
  EXPECT_EQ(out.publish_signalled(loan_with(out, 4), kAnyTime).delivered, 1U);
  const auto published = in.take();
  ASSERT_TRUE(published);
  const std::int64_t arrived = published->stamp_ns();
  EXPECT_GT(arrived, first->stamp_ns());
}

TEST(Signalled, HoldsForBytesToo) {
  Daemon daemon(single_model());
  Node node("test");
  auto out = node.output_port("/out", Type::untyped(16));
  auto in = node.input_port("/in");
  out.signal();
  EXPECT_EQ(out.publish_signalled(std::move(*out.loan(5)), kAnyTime).delivered, 1U);
  const auto sample = in.take();
  ASSERT_TRUE(sample);
  EXPECT_EQ(sample->size(), 5U);
}

}  // namespace
}  // namespace arbiter::test
