// How long samples wait at an input port that is tapped.
#include <gtest/gtest.h>

#include <chrono>
#include <thread>

#include <arbiter/arbiter.hpp>

#include "tests/client/samples.hpp"
#include "tests/support/daemon.hpp"

namespace arbiter::test {
namespace {

using namespace std::chrono_literals;

const std::string kModel =
    "<behaviors timeout='3600s'><arbiter at='/in'><select from='/out'/></arbiter></behaviors>";

class LatencyOfAPort : public testing::Test {
 protected:
  Tap<> tap() {
    TapOptions options;
    options.of = TapOf::input;
    options.may_wait = false;
    return watcher_.tap("/in", options);
  }
  void publish_and_take() {
    out_.publish(Number{1});
    EXPECT_TRUE(in_.take());
  }
  // Until the port's service thread has heard that it is (not) tapped.
  void see_measured(Tap<>& tap) {
    while (tap.latencies().samples() == 0) publish_and_take();
  }

  Daemon daemon_{kModel};
  Node node_{"test"};
  Node watcher_{"watcher"};
  OutputPort<Number> out_ = node_.output_port<Number>("/out");
  InputPort<Number> in_ = node_.input_port<Number>("/in");
};

TEST_F(LatencyOfAPort, IsMeasuredWhileItIsTapped) {
  publish_and_take();
  auto first = tap();
  see_measured(first);
  const Latencies before = first.latencies();
  EXPECT_EQ(before.buckets().size(), 128u);
  for (int i = 0; i < 10; ++i) publish_and_take();
  const Latencies ten = first.latencies().since(before);
  EXPECT_EQ(ten.samples(), 10u);
  EXPECT_GT(ten.percentile(0.5), 0ns);
  EXPECT_LE(ten.percentile(0.5), ten.percentile(0.99));
  EXPECT_LE(ten.percentile(0.99), ten.percentile(1));
}

TEST_F(LatencyOfAPort, IsFromTheArrivalToTheTake) {
  auto watching = tap();
  see_measured(watching);
  const Latencies before = watching.latencies();
  out_.publish(Number{2});
  const auto published = std::chrono::steady_clock::now();
  while (std::chrono::steady_clock::now() < published + 3ms) std::this_thread::yield();
  ASSERT_TRUE(in_.take());
  const Latencies one = watching.latencies().since(before);
  EXPECT_EQ(one.samples(), 1u);
  EXPECT_GT(one.percentile(0), 3ms);
}

TEST_F(LatencyOfAPort, IsEachTapsOwnCount) {
  auto first = tap();
  see_measured(first);
  auto second = tap();
  while (second.latencies().buckets().empty()) static_cast<void>(second.take());
  const std::uint64_t seen = first.latencies().samples();
  EXPECT_EQ(second.latencies().samples(), 0u);
  publish_and_take();
  EXPECT_EQ(second.latencies().samples(), 1u);
  EXPECT_EQ(first.latencies().samples(), seen + 1);
}

TEST_F(LatencyOfAPort, IsNotMeasuredAnyMoreWhenNobodyTapsIt) {
  auto first = std::make_optional(tap());
  see_measured(*first);
  first.reset();
  auto other = tap();  // the daemon has said: no more, and: again
  see_measured(other);
  other = watcher_.tap("/out", {});  // an output port's
  EXPECT_TRUE(other.latencies().buckets().empty());
  // A port that nobody taps counts nothing: what a tap counts from begins where the last one ended.
  EXPECT_TRUE(other.latencies().percentile(0.5) == 0ns);
}

TEST_F(LatencyOfAPort, GoesOnUnderAnotherDaemon) {
  auto watching = tap();
  see_measured(watching);
  daemon_.kill();
  publish_and_take();
  daemon_.restart();
  const std::uint64_t seen = watching.latencies().samples();
  while (watching.latencies().samples() <= seen + 5) publish_and_take();
}

TEST(Latencies, OfNothingAreNone) {
  const Latencies none;
  EXPECT_EQ(none.samples(), 0u);
  EXPECT_EQ(none.percentile(0.99), 0ns);
}

TEST(Latencies, TellPercentilesByTheirBounds) {
  const Latencies some({{10ns, 90}, {20ns, 9}, {40ns, 1}});
  EXPECT_EQ(some.percentile(0), 10ns);
  EXPECT_EQ(some.percentile(0.9), 10ns);
  EXPECT_EQ(some.percentile(0.99), 20ns);
  EXPECT_EQ(some.percentile(1), 40ns);
  EXPECT_EQ(some.since(Latencies({{10ns, 90}, {20ns, 0}, {40ns, 0}})).samples(), 10u);
  // Of a port that has been opened again.
  EXPECT_EQ(some.since(Latencies({{10ns, 91}, {20ns, 0}, {40ns, 0}})).samples(), 100u);
}

}  // namespace
}  // namespace arbiter::test
