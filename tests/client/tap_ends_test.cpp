// Taps over the ends of ports, components, programs that watch, and daemons.
#include <gtest/gtest.h>

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <future>
#include <map>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include <arbiter/arbiter.hpp>

#include "tests/client/component.hpp"
#include "tests/client/models.hpp"
#include "tests/client/samples.hpp"
#include "tests/client/tapping.hpp"
#include "tests/support/await.hpp"
#include "tests/support/daemon.hpp"
#include "tests/support/error_of.hpp"
#include "tests/support/raw_publisher.hpp"

namespace arbiter::test {
namespace {

TEST(Tap, FollowsASourceThatClosesAndComesAgain) {
  Daemon daemon(single_model());
  Node node("test");
  auto tap = node.tap<Number>("/out");
  for (int i = 0; i < 5; ++i) {
    {
      auto out = node.output_port<Number>("/out");
      out.publish(Number{i});
      out.publish(Number{i + 100});
    }
    EXPECT_EQ(wait_for_kind(tap, TapEventKind::sample).sample()->value, i);
    EXPECT_EQ(wait_for_kind(tap, TapEventKind::sample).sample()->value, i + 100);
    EXPECT_EQ(wait_for_kind(tap, TapEventKind::closed).sequence(), 2u);
  }
  EXPECT_EQ(tap.lost(), 0u);
}

// Whoever had the name before can still write to what it told taps by.
TEST(Tap, HearsOfASuccessorThoughThePortBeforeGoesOnTelling) {
  Daemon daemon(single_model());
  Node watcher("watcher");
  RawPublisher before(daemon.instance(), "/out");
  auto opening = std::async(std::launch::async, [&] { return watcher.tap("/out"); });
  before.admit();
  auto tap = opening.get();
  before.close();
  Node node("test");
  auto out = node.output_port<Number>("/out");
  out.publish(Number{1});
  for (bool is_heard = false; !is_heard;) {
    before.signal_at(shm::monotonic_now());
    const auto event = tap.take();
    is_heard = event && event->kind() == TapEventKind::sample;
  }
}

// Of what happened while it did not look.
TEST(Tap, HearsOfASuccessorBehindTheEndOfThePortBefore) {
  Daemon daemon(single_model());
  Node watcher("watcher");
  Node node("test");
  auto tap = watcher.tap("/out");
  std::vector<TapEventKind> kinds;
  const auto look = [&] {
    while (const auto event = tap.take()) kinds.push_back(event->kind());
  };
  std::vector<TapEventKind> expected;
  for (int i = 0; i < 2; ++i) {
    auto out = node.output_port<Number>("/out");
    out.signal();
    expected.insert(expected.end(),
                    {TapEventKind::state, TapEventKind::signal, TapEventKind::closed});
  }
  // The watcher's service thread hears of both while it opens a port of its own.
  const auto own = watcher.output_port<Number>("/own");
  await([&] {
    look();
    return kinds.size() >= expected.size();
  });
  EXPECT_EQ(kinds, expected);
}

TEST(Tap, IsToldTheActivityThatASourceHasOnceItsPortIsGone) {
  Daemon daemon(single_model());
  Node node("test");
  auto tap = node.tap<Number>("/out");
  for (const bool is_deactivated : {false, true}) {
    Component sender("sender");
    ASSERT_EQ(sender.tell("output /out"), "open");
    sender.tell("publish /out 1");
    if (is_deactivated) sender.tell("deactivate /out");
    sender.kill();
    const auto closed = wait_for_kind(tap, TapEventKind::closed);
    EXPECT_EQ(closed.is_deactivated(), is_deactivated);
    EXPECT_EQ(closed.was_active_at(std::chrono::steady_clock::now()), !is_deactivated);
    EXPECT_EQ(closed.lost(), 0u);
  }
}

// One that has published nothing since it was tapped has told nothing of its activity.
TEST(Tap, IsToldTheActivityOfASourceThatHasToldNothing) {
  Daemon daemon(single_model());
  Node node("test");
  Component sender("sender");
  ASSERT_EQ(sender.tell("output /out"), "open");
  sender.tell("publish /out 1");
  auto tap = node.tap<Number>("/out");
  sender.kill();
  const auto closed = wait_for_kind(tap, TapEventKind::closed);
  EXPECT_TRUE(closed.was_active_at(std::chrono::steady_clock::now()));
  EXPECT_EQ(closed.lost(), 0u) << "nothing was told that could be lost";
}

// It gives each of them the number that the next one had before.
TEST(Tap, GoesOnBesideOthersUnderADaemonThatHasBegunAnew) {
  Daemon daemon(override_model());
  NodeOptions options;
  options.service_thread = false;
  Node watcher("watcher", options);
  std::map<std::string, Tap<Number>> taps;
  for (const std::string name : {"/low", "/high", "/stop"}) {
    taps.emplace(name, watcher.tap<Number>(name));
  }
  daemon.terminate();
  daemon.restart();
  Node node("test");
  std::map<std::string, OutputPort<Number>> outputs;
  outputs.emplace("/low", node.output_port<Number>("/low"));
  await([&] {
    watcher.service();
    return daemon.taps_of("/low") == 1;
  });
  for (const std::string name : {"/high", "/stop"}) {
    outputs.emplace(name, node.output_port<Number>(name));
  }
  std::int64_t value = 0;
  for (auto& [name, output] : outputs) {
    ++value;
    Tap<Number>& tap = taps.at(name);
    await([&watcher, &tap, &port = output, value] {
      watcher.service();
      port.publish(Number{value});
      return next_of(tap).has_value();
    });
  }
}

TEST(Tap, HearsThatASourceHasEndedThoughNoDaemonWasThere) {
  Daemon daemon(single_model());
  Node node("test");
  auto tap = node.tap<Number>("/out");
  {
    Component sender("sender");
    ASSERT_EQ(sender.tell("output /out"), "open");
    sender.tell("publish /out 1");
    EXPECT_EQ(wait_for_kind(tap, TapEventKind::sample).sample()->value, 1);
    daemon.kill();
    sender.kill();
  }
  daemon.restart();
  Component successor("successor");
  ASSERT_EQ(successor.tell("output /out"), "open");
  successor.tell("publish /out 2");
  EXPECT_EQ(wait_for_kind(tap, TapEventKind::closed).sequence(), 1u);
}

// A daemon that knows of nobody who was there before numbers ports from the beginning.
TEST(Tap, HearsThatASourceHasEndedThoughItsSuccessorHasItsNumber) {
  Daemon daemon(single_model());
  Node node("test");
  auto tap = node.tap<Number>("/out");
  {
    Component second("second");
    ASSERT_EQ(second.tell("output /second"), "open");
    Component sender("sender");
    ASSERT_EQ(sender.tell("output /out"), "open");
    sender.tell("publish /out 1");
    EXPECT_EQ(wait_for_kind(tap, TapEventKind::sample).sample()->value, 1);
    daemon.kill();
    second.kill();
    sender.kill();
  }
  daemon.restart();
  auto second = node.output_port<Number>("/second");  // behind the tap: it is known by now
  Component successor("successor");
  ASSERT_EQ(successor.tell("output /out"), "open");
  successor.tell("publish /out 2");
  EXPECT_EQ(wait_for_kind(tap, TapEventKind::closed).sequence(), 1u);
  successor.tell("publish /out 3");
  EXPECT_EQ(wait_for_kind(tap, TapEventKind::sample).source(), "/out");
}

TEST(Tap, HearsOfTheEndFromADaemonThatNeverKnewTheSource) {
  for (const TapOf of : {TapOf::output, TapOf::input}) {
    Daemon daemon(single_model());
    Node node("test");
    auto tap = node.tap<Number>(of == TapOf::output ? "/out" : "/in", {.of = of});
    Component sender("sender");
    ASSERT_EQ(sender.tell("output /out"), "open");
    sender.tell("publish /out 1");
    EXPECT_EQ(wait_for_kind(tap, TapEventKind::sample).sample()->value, 1);
    daemon.kill();
    sender.tell("publish /out 2");
    sender.tell("deactivate /out");
    sender.kill();
    daemon.restart();
    const auto closed = wait_for_kind(tap, TapEventKind::closed);
    EXPECT_EQ(closed.sequence(), 2u);
    EXPECT_TRUE(closed.is_deactivated());
    EXPECT_EQ(tap.lost(), 0u);
  }
}

TEST(Tap, SeesAllThatAPublisherToldBeforeItWasKilled) {
  Daemon daemon(single_model());
  Node node("test");
  auto tap = node.tap<Number>("/out");
  for (int round = 0; round < 5; ++round) {
    Component sender("sender");
    ASSERT_EQ(sender.tell("output /out"), "open");
    EXPECT_EQ(sender.tell("publish /out 3"), "0 0 0");
    EXPECT_EQ(wait_for_kind(tap, TapEventKind::sample).sample()->value, 3);
    sender.begin("publish /out 0 1000000000");
    static_cast<void>(wait_for_kind(tap, TapEventKind::sample));
    sender.kill();
    static_cast<void>(wait_for_kind(tap, TapEventKind::closed));
  }
}

TEST(Tap, ItsDeathHoldsUpNobodyAndGivesItsPlaceBack) {
  Daemon daemon(single_model());
  Node node("test", {.service_thread = false});
  auto out = node.output_port<Number>("/out");
  auto in = node.input_port<Number>("/in");
  for (int i = 0; i < 40; ++i) {
    Component watcher("watcher");
    ASSERT_EQ(watcher.tell("tap /out 16"), "open");
    node.service();
    out.publish(Number{i});
    ASSERT_EQ(watcher.tell("hold-event /out"), std::to_string(i));
    watcher.begin("watch /out");
    for (int n = 0; n < 100; ++n) EXPECT_EQ(out.publish(Number{n}).delivered, 1u);
    watcher.kill();
    for (int n = 0; n < 100; ++n) EXPECT_EQ(out.publish(Number{n}).delivered, 1u);
    node.service();
  }
  EXPECT_EQ(daemon.source("/out")["no_slot"], 0);
}

TEST(Tap, AStoppedOneHoldsUpNobodyAndFindsItsSampleAsItWas) {
  Daemon daemon(single_model());
  Component watcher("watcher");
  ASSERT_EQ(watcher.tell("tap /out 2"), "open");
  Node node("test");
  auto out = node.output_port<Number>("/out");
  auto in = node.input_port<Number>("/in");
  EXPECT_EQ(out.publish(Number{-1}).delivered, 1u);
  ASSERT_EQ(watcher.tell("hold-event /out"), "-1");
  watcher.process().stop();
  for (int i = 0; i < 5000; ++i) EXPECT_EQ(out.publish(Number{i}).delivered, 1u);
  watcher.process().signal(SIGCONT);
  EXPECT_EQ(watcher.tell("held-event"), "-1");
}

TEST(Tap, GoesOnUnderAnotherDaemon) {
  Daemon daemon(single_model());
  Component sender("sender");
  ASSERT_EQ(sender.tell("output /out"), "open");
  Node node("test");
  auto tap = node.tap<Number>("/out");
  sender.tell("publish /out 1");
  EXPECT_EQ(wait_for_kind(tap, TapEventKind::sample).sample()->value, 1);
  daemon.kill();
  sender.tell("publish /out 2");
  EXPECT_EQ(wait_for_kind(tap, TapEventKind::sample).sample()->value, 2) << "without a daemon";
  daemon.restart();
  await([&] { return daemon.source("/out")["open"] == true; });
  auto other = node.tap<Number>("/out");  // both are back by now
  hear_all(sender);
  for (int i = 3; i < 10; ++i) {
    sender.tell("publish /out " + std::to_string(i));
    EXPECT_EQ(wait_for_kind(tap, TapEventKind::sample).sample()->value, i);
    EXPECT_EQ(wait_for_kind(other, TapEventKind::sample).sample()->value, i);
  }
  EXPECT_EQ(sender.tell("close /out"), "closed");
  static_cast<void>(wait_for_kind(tap, TapEventKind::closed));
  ASSERT_EQ(sender.tell("output /out"), "open");
  sender.tell("publish /out 11");
  EXPECT_EQ(wait_for_kind(tap, TapEventKind::sample).sample()->value, 11);
  EXPECT_EQ(tap.lost(), 0u);
}

// By the time that its program has it, the daemon that opened it has gone, and another has come.
TEST(Tap, OpenedByADaemonThatIsReplacedAtOnceIsKnownToTheNext) {
  Daemon daemon(single_model());
  Component sender("sender");
  ASSERT_EQ(sender.tell("output /out"), "open");
  Node* self = nullptr;
  bool is_replaced = false;
  NodeOptions options;
  options.service_thread = false;
  // Within the opening, when it has been answered.
  options.on_notice = [&](const Notice& notice) {
    if (notice.port != "/in" || is_replaced) return;
    is_replaced = true;
    { auto answered_after_it = self->tap<Number>("/out"); }
    daemon.kill();
    daemon.restart();
    auto answered_by_the_next = self->input_port<Number>("/another");
  };
  Node node("test", options);
  self = &node;
  auto in = node.input_port<Number>("/in");
  daemon.load(kNoRules);  // which the node hears, and gives notice of, when it opens the tap
  auto tap = node.tap<Number>("/out");
  ASSERT_TRUE(is_replaced);
  await([&] { return daemon.source("/out")["open"] == true; });
  auto last = node.input_port<Number>("/last");  // what the node has said before has been heard
  await([&] { return daemon.taps_of("/out") != 0; });  // its publisher has answered
  EXPECT_EQ(daemon.taps_of("/out"), 1u);
}

// Each daemon gives it another number: it was looked for by the first one's.
TEST(Tap, OpenedByADaemonWhoseSuccessorDoesNotAnswerLeavesNothing) {
  Daemon daemon(single_model());
  Component stopped("stopped");  // or the tap would be connected at once
  ASSERT_EQ(stopped.tell("output /in"), "open");
  stopped.process().stop();
  std::optional<Node> node;
  bool is_replaced = false;
  NodeOptions options;
  options.service_thread = false;
  options.connect_timeout = std::chrono::milliseconds(100);
  // That the tap is of the wrong end, said once it has its number and before it is connected.
  options.on_notice = [&](const Notice&) {
    if (std::exchange(is_replaced, true)) return;
    daemon.kill();
    daemon.restart();
    auto answered_by_the_next = node->input_port<Number>("/another");
    daemon.process().stop();
  };
  node.emplace("test", options);
  const std::string error = error_of([&] { auto tap = node->tap<Number>("/in"); });
  EXPECT_NE(error.find("has not answered"), std::string::npos) << error;
  EXPECT_TRUE(is_replaced);
  daemon.process().signal(SIGCONT);
  node.reset();
  await([&] { return daemon.status()["clients"] == 1; });
}

}  // namespace
}  // namespace arbiter::test
