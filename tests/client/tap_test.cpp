// Watching sources without being a destination.
#include <fcntl.h>
#include <gtest/gtest.h>
#include <poll.h>

#include <algorithm>
#include <chrono>
#include <vector>

#include <arbiter/arbiter.hpp>

#include "tests/client/component.hpp"
#include "tests/client/models.hpp"
#include "tests/client/samples.hpp"
#include "tests/client/tapping.hpp"
#include "tests/support/child_process.hpp"
#include "tests/support/daemon.hpp"
#include "tests/support/error_of.hpp"
#include "tests/support/temporary_directory.hpp"
#include "tests/support/text_files.hpp"

namespace arbiter::test {
namespace {

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
  hear_all(sender);
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
  hear_all(sender);
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
