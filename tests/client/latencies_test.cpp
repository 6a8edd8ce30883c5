// How long samples wait at an input port that is tapped.
#include <gtest/gtest.h>

#include <chrono>
#include <optional>
#include <thread>

#include <arbiter/arbiter.hpp>

#include "tests/client/samples.hpp"
#include "tests/support/daemon.hpp"
#include "tests/support/raw_client.hpp"
#include "tests/support/raw_port.hpp"

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
  // Until the port's service thread has heard that it is tapped.
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

TEST_F(LatencyOfAPort, IsNotThatOfAnOutputPort) {
  auto other = watcher_.tap("/out");
  EXPECT_TRUE(other.latencies().buckets().empty());
}

// What a component hears whose input port is tapped by two.
TEST(LatencyOfAnInputPort, IsAskedForAsLongAsThereIsATap) {
  const Daemon daemon(kModel);
  RawClient component(daemon.instance());
  component.hello("component");
  const auto segment = raw_input_segment();
  const shm::Bell bell;
  component.send(RawClient::message(wire::MessageKind::kOpenInput, "/in"),
                 {segment.get(), bell.for_publishers().get()});
  const auto port = component.expect(wire::MessageKind::kOpened).message.port;
  Node watcher("watcher");
  TapOptions options;
  options.of = TapOf::input;
  std::optional first(watcher.tap("/in", options));
  auto heard = component.expect(wire::MessageKind::kMeasure).message;
  EXPECT_EQ(heard.port, port);
  EXPECT_EQ(heard.value, 1u);
  std::optional second(watcher.tap("/in", options));
  EXPECT_EQ(component.expect(wire::MessageKind::kMeasure).message.value, 1u);
  first.reset();
  second.reset();
  EXPECT_EQ(component.expect(wire::MessageKind::kMeasure).message.value, 0u);
  component.send(RawClient::message(wire::MessageKind::kStatus));
  wire::Received next;
  ASSERT_TRUE(component.receive(next));
  EXPECT_EQ(next.message.kind, wire::MessageKind::kStatusReply);  // and said once
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
