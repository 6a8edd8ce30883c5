// Taps of input ports: all their sources, and what became of samples at the take.
#include <gtest/gtest.h>

#include <string>
#include <vector>

#include <arbiter/arbiter.hpp>

#include "tests/client/component.hpp"
#include "tests/client/models.hpp"
#include "tests/client/samples.hpp"
#include "tests/client/tapping.hpp"
#include "tests/support/daemon.hpp"
#include "tests/support/error_of.hpp"

namespace arbiter::test {
namespace {

TEST(Tap, OfAnInputPortSeesAllSourcesThatTheModelConnectsToIt) {
  Daemon daemon(override_model());
  Node node("test");
  auto tap = node.tap<Number>("/in", {.of = TapOf::input});
  auto low = node.output_port<Number>("/low");
  auto high = node.output_port<Number>("/high");
  auto stop = node.output_port<Number>("/stop");
  low.publish(Number{1});
  high.publish(Number{2});
  stop.publish(Number{3});
  low.publish(Number{4});
  const auto expect = [&](const char* source, std::int64_t value) {
    const auto event = next_of(tap);
    ASSERT_TRUE(event);
    EXPECT_EQ(event->source(), source);
    EXPECT_EQ(event->sample()->value, value);
  };
  expect("/low", 1);
  expect("/high", 2);
  expect("/low", 4);
  EXPECT_FALSE(next_of(tap)) << "/stop is only sensed";
}

// A name that nobody has yet may come; one of the other kind waits in vain.
TEST(Tap, OfAPortOfTheOtherKindIsToldSo) {
  Daemon daemon(override_model());
  std::vector<std::string> told;
  NodeOptions options;
  options.service_thread = false;
  options.on_notice = [&](const Notice& notice) {
    EXPECT_EQ(notice.kind, NoticeKind::unmentioned);
    told.push_back(notice.text);
  };
  Node node("test", options);
  auto as_output = node.tap<Number>("/in");
  auto as_input = node.tap<Number>("/low", {.of = TapOf::input});
  auto right = node.tap<Number>("/low");
  auto right_too = node.tap<Number>("/in", {.of = TapOf::input});
  auto unknown = node.tap<Number>("/nobody");
  node.service();
  EXPECT_EQ(told,
            (std::vector<std::string>{
                "in the model in force /in is an input port, and here it is tapped as an output "
                "port, so that nothing comes; write TapOf::input",
                "in the model in force /low is an output port, and here it is tapped as an input "
                "port, so that nothing comes; leave TapOf::input out"}));
}

// What became of accepted samples after they were accepted. `in` is /in.
struct AtTheTake {
  Daemon daemon{override_model()};
  Node node{"test"};
  OutputPort<Number> low = node.output_port<Number>("/low");
  OutputPort<Number> high = node.output_port<Number>("/high");
  Tap<Number> tap = node.tap<Number>("/in", {.of = TapOf::input});
};

TEST(Tap, OfAnInputPortIsToldWhatWasOvertakenAndWhatWasDroppedAtTheTake) {
  AtTheTake scene;
  for (int opened = 0; opened < 3; ++opened) {
    auto in = scene.node.input_port<Number>("/in", {.depth = 2});
    for (int i = 1; i <= 5; ++i) scene.low.publish(Number{i});
    EXPECT_EQ(take_from(in), 4);
    const auto overtaken = wait_for_kind(scene.tap, TapEventKind::overtaken);
    EXPECT_EQ(overtaken.source(), "/low");
    EXPECT_EQ(overtaken.count(), 3u);
    EXPECT_EQ(overtaken.sample(), nullptr);
    EXPECT_TRUE(overtaken.destinations().empty());
    scene.high.signal();
    EXPECT_FALSE(in.take());
    const auto dropped = wait_for_kind(scene.tap, TapEventKind::dropped);
    EXPECT_EQ(dropped.source(), "/low");
    EXPECT_EQ(dropped.count(), 1u);
    EXPECT_EQ(dropped.sequence() % 5, 0u) << "the port has done with all";
    scene.high.deactivate();
  }
  EXPECT_EQ(scene.tap.lost(), 0u);
}

TEST(Tap, OfAnInputPortIsToldToTheLastSampleOfAPortThatHasGone) {
  AtTheTake scene;
  Component receiver("receiver");
  ASSERT_EQ(receiver.tell("input /in 2 1 0"), "open");
  hear_all(scene.node);
  for (int i = 1; i <= 100; ++i) scene.low.publish(Number{i});
  receiver.tell("take /in");
  receiver.kill();
  EXPECT_EQ(wait_for_kind(scene.tap, TapEventKind::overtaken).count(), 98u);
}

TEST(Tap, OfAnOutputPortIsToldNothingOfTakes) {
  Daemon daemon(single_model());
  Node node("test");
  auto out = node.output_port<Number>("/out");
  auto in = node.input_port<Number>("/in", {.depth = 1});
  auto tap = node.tap<Number>("/out", {.may_wait = false});
  for (int i = 0; i < 5; ++i) out.publish(Number{i});
  EXPECT_EQ(take_from(in), 4);
  while (const auto event = tap.take()) EXPECT_EQ(event->count(), 0u);
}

TEST(Tap, OfAnInputPortSeesNothingOfASourceWhileTheModelDoesNotConnectIt) {
  Daemon daemon(only("a"));
  Node node("test");
  auto a = node.output_port<Number>("/a");
  auto tap = node.tap<Number>("/in", {.of = TapOf::input});
  for (std::int64_t i = 0; i < 10; ++i) {
    a.publish(Number{3 * i});
    EXPECT_EQ(wait_for_kind(tap, TapEventKind::sample).sample()->value, 3 * i);
    daemon.load(only("b"));
    a.publish(Number{3 * i + 1});
    static_cast<void>(wait_for_kind(tap, TapEventKind::closed));
    EXPECT_FALSE(next_of(tap));
    daemon.load(only("a"));
  }
  EXPECT_EQ(tap.lost(), 0u);
}

}  // namespace
}  // namespace arbiter::test
