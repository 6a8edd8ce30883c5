// Watching sources without being a destination.
#include <fcntl.h>
#include <gtest/gtest.h>
#include <poll.h>

#include <algorithm>
#include <chrono>
#include <optional>
#include <vector>

#include <arbiter/arbiter.hpp>

#include "tests/client/component.hpp"
#include "tests/client/models.hpp"
#include "tests/client/samples.hpp"
#include "tests/support/child_process.hpp"
#include "tests/support/daemon.hpp"
#include "tests/support/error_of.hpp"
#include "tests/support/temporary_directory.hpp"
#include "tests/support/text_files.hpp"

namespace arbiter::test {
namespace {

constexpr auto kForever = std::chrono::hours::max();

// The next event that is about an arrival or a deactivation.
template <class T>
std::optional<TapEvent<T>> next_of(Tap<T>& tap) {
  while (auto event = tap.take()) {
    if (event->kind() == TapEventKind::sample || event->kind() == TapEventKind::signal ||
        event->kind() == TapEventKind::deactivation) {
      return event;
    }
  }
  return std::nullopt;
}

// Passes over events until one of that kind.
template <class T>
TapEvent<T> wait_for_kind(Tap<T>& tap, TapEventKind kind) {
  for (;;) {
    auto event = tap.wait_for(kForever);
    if (event && event->kind() == kind) return std::move(*event);
  }
}

// Publishes signals until the tap sees its source. A component has 0.2 s to take a tap in, and may
// need more for large samples on a machine that is busy.
template <class Port, class T>
void wait_until_watched(Port& out, Tap<T>& tap) {
  do {
    out.signal();
  } while (!tap.take());
  while (tap.take()) {
  }
}

TEST(Tap, SeesWinnersAndLosersAndWhatBecameOfThem) {
  Daemon daemon(override_model());
  Node node("test");
  auto low = node.output_port<Number>("/low");
  auto high = node.output_port<Number>("/high");
  auto in = node.input_port<Number>("/in");
  auto tap = node.tap<Number>("/low");
  low.publish(Number{7});
  high.signal();
  low.publish(Number{8});
  low.signal();
  low.deactivate();
  const auto state = tap.take();
  ASSERT_TRUE(state);
  EXPECT_EQ(state->kind(), TapEventKind::state);
  EXPECT_EQ(state->source(), "/low");
  EXPECT_EQ(state->sequence(), 0u);
  auto event = next_of(tap);
  ASSERT_TRUE(event);
  EXPECT_EQ(event->kind(), TapEventKind::sample);
  ASSERT_NE(event->sample(), nullptr);
  EXPECT_EQ(event->sample()->value, 7);
  EXPECT_EQ(event->sequence(), 1u);
  EXPECT_EQ(event->size(), sizeof(Number));
  EXPECT_EQ(event->at("/in"), Fate::accepted);
  EXPECT_EQ(event->generation(), 1u);
  EXPECT_TRUE(event->was_active_at(event->time()));
  ASSERT_EQ(event->destinations().size(), 1u);
  EXPECT_EQ(event->destinations()[0].port, "/in");
  event = {};
  event = next_of(tap);
  ASSERT_TRUE(event);
  EXPECT_EQ(event->sample()->value, 8);
  EXPECT_EQ(event->at("/in"), Fate::discarded);
  event = {};
  event = next_of(tap);
  ASSERT_TRUE(event);
  EXPECT_EQ(event->kind(), TapEventKind::signal);
  EXPECT_EQ(event->sample(), nullptr);
  EXPECT_EQ(event->at("/in"), Fate::discarded);
  event = next_of(tap);
  ASSERT_TRUE(event);
  EXPECT_EQ(event->kind(), TapEventKind::deactivation);
  EXPECT_TRUE(event->is_deactivated());
  EXPECT_FALSE(next_of(tap));
  EXPECT_EQ(tap.lost(), 0u);
  EXPECT_EQ(tap.lost_samples(), 0u);
}

TEST(Tap, SeesWhatAFullQueueRefuses) {
  Daemon daemon(single_model());
  Node node("test");
  auto out = node.output_port<Number>("/out");
  auto in = node.input_port<Number>("/in", {.depth = 1, .when_full = refuse_new});
  auto tap = node.tap<Number>("/out");
  for (int i = 0; i < 2; ++i) out.publish(Number{i});
  EXPECT_EQ(next_of(tap)->at("/in"), Fate::accepted);
  EXPECT_EQ(next_of(tap)->at("/in"), Fate::refused);
  EXPECT_EQ(take_from(in), 0);
  out.publish(Number{3});
  EXPECT_EQ(next_of(tap)->at("/in"), Fate::accepted) << "a refusal counts once";
}

TEST(Tap, SeesThatAConnectionIsRefused) {
  Daemon daemon(single_model());
  NodeOptions quiet;
  quiet.on_notice = [](const Notice&) {};
  Node node("test", quiet);
  auto out = node.output_port<Number>("/out");
  auto in = node.input_port<char>("/in");
  auto tap = node.tap("/out");
  EXPECT_EQ(out.publish(Number{1}).refused, 1u);
  EXPECT_EQ(next_of(tap)->at("/in"), Fate::refused);
}

TEST(Tap, IsNoDestinationAndNeedsNoModelThatMentionsIt) {
  Daemon daemon;
  NodeOptions quiet;
  quiet.on_notice = [](const Notice&) {};
  Node node("test", quiet);
  auto tap = node.tap<Number>("/nobody/knows:o");
  auto out = node.output_port<Number>("/nobody/knows:o");
  const Outcome outcome = out.publish(Number{5});
  EXPECT_EQ(outcome.delivered + outcome.discarded + outcome.refused, 0u);
  const auto event = next_of(tap);
  ASSERT_TRUE(event);
  EXPECT_EQ(event->sample()->value, 5);
  EXPECT_TRUE(event->destinations().empty());
}

TEST(Tap, ReadsInPlaceWhatThePublisherHasWritten) {
  Daemon daemon(single_model());
  Node node("test");
  auto out = node.output_port<Image>("/out");
  auto tap = node.tap<Image>("/out");
  wait_until_watched(out, tap);
  for (int i = 0; i < 20; ++i) {
    auto loan = out.loan();
    const std::string written = where(loan->get());
    out.publish(std::move(*loan));
    const auto event = next_of(tap);
    ASSERT_TRUE(event && event->sample() != nullptr);
    EXPECT_EQ(where(event->sample()), written);
  }
}

TEST(Tap, IsUntypedOrOfTheSourcesType) {
  Daemon daemon(single_model());
  Node node("test");
  auto out = node.output_port<Number>("/out");
  auto untyped = node.tap("/out");
  out.publish(Number{9});
  const auto event = next_of(untyped);
  ASSERT_TRUE(event && event->sample());
  ASSERT_EQ(event->sample()->size(), sizeof(Number));
  EXPECT_EQ(event->type(), type_of<Number>());
  const std::string why = error_of([&] { auto wrong = node.tap<char>("/out"); });
  EXPECT_NE(why.find("/out cannot be watched"), std::string::npos) << why;
}

TEST(Tap, LosesItsOwnOldestEventsAndIsToldTheStateFirst) {
  Daemon daemon(single_model());
  Node node("test");
  auto out = node.output_port<Number>("/out");
  auto tap = node.tap<Number>("/out");
  constexpr int kPublished = 5000;
  for (int i = 1; i <= kPublished; ++i) out.publish(Number{i});
  const auto gap = tap.take();
  ASSERT_TRUE(gap);
  EXPECT_EQ(gap->kind(), TapEventKind::state);
  EXPECT_GT(gap->lost(), 0u);
  EXPECT_TRUE(gap->was_active_at(gap->time()));
  std::uint64_t sequence = gap->sequence();
  while (auto event = tap.take()) {
    ASSERT_EQ(event->kind(), TapEventKind::sample);
    EXPECT_EQ(event->sequence(), ++sequence);
    if (event->sample() != nullptr) {
      EXPECT_EQ(event->sample()->value, static_cast<std::int64_t>(sequence));
    }
  }
  EXPECT_EQ(sequence, static_cast<std::uint64_t>(kPublished));
  EXPECT_EQ(tap.lost(), gap->lost());
  EXPECT_GT(tap.lost_samples(), 0u) << "fewer samples are kept than events";
  EXPECT_EQ(daemon.source("/out")["no_slot"], 0);
}

TEST(Tap, WhatItHoldsStaysAsItIs) {
  Daemon daemon(single_model());
  Node node("test");
  auto out = node.output_port<Number>("/out");
  auto in = node.input_port<Number>("/in");
  auto tap = node.tap<Number>("/out", {.max_held = 2});
  out.publish(Number{-1});
  auto first = next_of(tap);
  out.publish(Number{-2});
  auto second = next_of(tap);
  for (int i = 0; i < 1000; ++i) EXPECT_EQ(out.publish(Number{i}).delivered, 1u);
  EXPECT_EQ(first->sample()->value, -1);
  EXPECT_EQ(second->sample()->value, -2);
  const std::string why = error_of([&] {
    while (tap.take()) {
    }
  });
  EXPECT_NE(why.find("max_held"), std::string::npos) << why;
  first.reset();
  EXPECT_TRUE(next_of(tap)) << "and goes on where it was";
  EXPECT_EQ(daemon.source("/out")["no_slot"], 0);
}

TEST(Tap, WithoutHoldsSaysHowLargeSamplesAre) {
  Daemon daemon(single_model());
  Node node("test");
  auto out = node.output_port<Number>("/out");
  auto tap = node.tap<Number>("/out", {.max_held = 0});
  for (int i = 0; i < 3; ++i) out.publish(Number{i});
  for (int i = 0; i < 3; ++i) {
    const auto event = next_of(tap);
    ASSERT_TRUE(event);
    EXPECT_EQ(event->sample(), nullptr);
    EXPECT_EQ(event->size(), sizeof(Number));
  }
  EXPECT_EQ(tap.lost_samples(), 0u);
}

// The most that max_memory allows is the components', tapped or not.
TEST(Tap, ShrinksNoComponentsDepth) {
  Daemon daemon(fan_out_model(2));
  Node node("test");
  OutputPortOptions options;
  options.max_memory = 64 * 12;  // two loans, a copy, and 9
  auto out = node.output_port<Number>("/out", options);
  std::vector<Tap<Number>> taps;
  for (int i = 0; i < 4; ++i) taps.push_back(node.tap<Number>("/out", {.max_held = 16}));
  auto first = node.input_port<Number>("/in0", {.depth = 5, .max_held = 1});
  auto second = node.input_port<Number>("/in1", {.depth = 2, .max_held = 1});
  std::vector<TapEvent<Number>> held;
  for (std::int64_t i = 1; i <= 300; ++i) {
    EXPECT_EQ(out.publish(Number{i}).delivered, 2u);
    for (auto& tap : taps) {
      if (i > 16) break;
      if (auto event = next_of(tap)) held.push_back(std::move(*event));
    }
  }
  EXPECT_EQ(take_all(first), (std::vector<std::int64_t>{296, 297, 298, 299, 300}));
  EXPECT_EQ(take_all(second), (std::vector<std::int64_t>{299, 300}));
  EXPECT_EQ(held.size(), 64u);
  for (const auto& event : held) {
    EXPECT_EQ(event.sample()->value, static_cast<std::int64_t>(event.sequence()));
  }
  EXPECT_EQ(daemon.source("/out")["no_slot"], 0);
}

TEST(Tap, IsRefusedWhereItDoesNotFit) {
  Daemon daemon(single_model());
  Node node("test");
  auto out = node.output_port<Number>("/out");
  std::vector<Tap<Number>> taps;
  for (int i = 0; i < 4; ++i) taps.push_back(node.tap<Number>("/out", {.max_held = 16}));
  const std::string why =
      error_of([&] { auto one_more = node.tap<Number>("/out", {.max_held = 1}); });
  EXPECT_NE(why.find("may hold 64 samples together"), std::string::npos) << why;
  taps.pop_back();
  EXPECT_EQ(error_of([&] { auto another = node.tap<Number>("/out"); }), "no error");
  taps.clear();
  for (int i = 0; i < 16; ++i) taps.push_back(node.tap<Number>("/out", {.max_held = 0}));
  const std::string full = error_of([&] { auto one_more = node.tap<Number>("/out"); });
  EXPECT_NE(full.find("16 taps already"), std::string::npos) << full;
}

TEST(Tap, IsWokenForEachEventAndByNothingElse) {
  Daemon daemon(single_model());
  Component sender("sender");
  ASSERT_EQ(sender.tell("output /out"), "open");
  Node node("test");
  auto tap = node.tap<Number>("/out");
  for (int i = 0; i < 50; ++i) {
    sender.begin("publish /out " + std::to_string(i));
    EXPECT_EQ(wait_for_kind(tap, TapEventKind::sample).sample()->value, i);
    sender.answer();
  }
  EXPECT_FALSE(tap.wait_for(std::chrono::milliseconds(1)));
}

TEST(Tap, ItsDescriptorBecomesReadableForEachEvent) {
  Daemon daemon(single_model());
  Node node("test");
  auto out = node.output_port<Number>("/out");
  auto tap = node.tap<Number>("/out");
  pollfd polled{tap.fd(), POLLIN, 0};
  while (tap.take()) {
  }
  EXPECT_EQ(::poll(&polled, 1, 0), 0);
  for (int i = 0; i < 10; ++i) {
    out.publish(Number{i});
    ASSERT_EQ(::poll(&polled, 1, -1), 1);
    EXPECT_EQ(next_of(tap)->sample()->value, i);
    EXPECT_FALSE(tap.take());
    EXPECT_EQ(::poll(&polled, 1, 0), 0);
  }
}

TEST(Tap, OneThatOnlyPollsMayNotWait) {
  Daemon daemon(single_model());
  Node node("test");
  auto tap = node.tap("/out", {.may_wait = false});
  EXPECT_NE(error_of([&] { static_cast<void>(tap.wait_for(kForever)); }).find("may_wait"),
            std::string::npos);
  EXPECT_NE(error_of([&] { static_cast<void>(tap.fd()); }).find("may_wait"), std::string::npos);
  auto out = node.output_port<Number>("/out");
  out.publish(Number{1});
  EXPECT_TRUE(next_of(tap));
}

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
  auto other = node.tap<Number>("/out");  // both are back by now
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

// The program of docs/taps.md.
TEST(Tap, OfThePageShowsWhatArrives) {
  Daemon daemon(rules(arbiter_at("/Arm/pos:i", select("/Object/pos:o"))));
  Node node("test");
  auto out = node.output_port<Number>("/Object/pos:o");
  auto in = node.input_port<Number>("/Arm/pos:i");
  const TemporaryDirectory directory;
  const std::string file = directory.path() + "/out";
  const shm::FileDescriptor to(::open(file.c_str(), O_WRONLY | O_CREAT | O_TRUNC, 0600));
  ChildProcess program({ARBITER_TAPS_PAGE}, {}, {-1, to.get(), -1});
  pollfd end{program.descriptor(), POLLIN, 0};
  while (::poll(&end, 1, 1) == 0) out.publish(Number{1});
  EXPECT_EQ(program.wait(), 0);
  const std::string shown = content_of(file);
  EXPECT_EQ(std::count(shown.begin(), shown.end(), '\n'), 10);
  EXPECT_EQ(shown.rfind("/Object/pos:o #", 0), 0u) << shown;
  EXPECT_NE(shown.find(", 8 bytes, accepted at /Arm/pos:i\n"), std::string::npos) << shown;
}

// To the last: what is seen, and what is said to be lost, is what was published; and the fates are
// those that the publisher was told.
TEST(Tap, ItsAccountBalancesUnderAPublisherThatDoesNotStop) {
  Daemon daemon(override_model());
  Node node("test");
  auto in = node.input_port<Number>("/in");
  Component sender("sender");
  ASSERT_EQ(sender.tell("output /low"), "open");
  auto high = node.output_port<Number>("/high");
  auto tap = node.tap<Number>("/low");
  constexpr std::uint64_t kPublished = 300'000;
  sender.tell("publish /low 1");
  EXPECT_EQ(wait_for_kind(tap, TapEventKind::sample).sequence(), 1u);  // from here on all are
  sender.begin("publish /low 2 " + std::to_string(kPublished - 1));
  std::uint64_t seen = 1;
  std::uint64_t last = 1;
  for (int round = 0; last < kPublished; ++round) {
    const auto event = tap.take();
    if (!event) continue;
    if (event->kind() == TapEventKind::state) {
      if (event->lost() != 0) last = event->sequence();
      if (round % 2 == 0) {
        high.signal();
      } else {
        high.deactivate();
      }
      continue;
    }
    if (event->kind() != TapEventKind::sample) continue;
    ++seen;
    ASSERT_EQ(event->sequence(), ++last);
    ASSERT_NE(event->at("/in"), Fate::none);
    if (event->sample() != nullptr) {
      ASSERT_EQ(event->sample()->value, static_cast<std::int64_t>(last));
    }
  }
  sender.answer();
  EXPECT_EQ(seen + tap.lost(), kPublished);
  EXPECT_EQ(daemon.source("/low")["no_slot"], 0);
}

}  // namespace
}  // namespace arbiter::test
