// A publisher whose memory lies to a tap, and one that is killed while it tells.
#include <gtest/gtest.h>
#include <poll.h>

#include <algorithm>
#include <cstdint>
#include <limits>
#include <memory>
#include <random>
#include <string>
#include <utility>
#include <vector>

#include <arbiter/arbiter.hpp>

#include "client/tap/tap_core.hpp"
#include "shm/event_ring.hpp"
#include "shm/utf8.hpp"
#include "tests/support/error_of.hpp"
#include "tests/support/raw_port.hpp"
#include "tests/support/written.hpp"

namespace arbiter::test {
namespace {

// A publisher that is put together by hand, and its tap.
class HostilePublisher {
 public:
  explicit HostilePublisher(const shm::EventShape& shape = {4, 2, 2})
      : output_(raw_output_segment()) {
    events_->initialize(shape);
    shm::seal(events_.descriptor, shm::Seals::kOneWriter);
    events_->places[0].first.store(1);
    events_->places[0].link.store(9);
  }

  // A tap that has not been told of it.
  static std::unique_ptr<detail::TapCore> lone_tap(std::uint32_t max_held) {
    TapOptions options;
    options.max_held = max_held;
    return std::make_unique<detail::TapCore>("tap", Type::untyped(0), options,
                                             std::make_shared<const detail::ServiceBell>(),
                                             shm::Residence::kMapped);
  }
  std::unique_ptr<detail::TapCore> tap(std::uint32_t max_held) {
    auto core = lone_tap(max_held);
    core->add_source(map());
    return core;
  }
  std::shared_ptr<const detail::TapSource> map(std::uint32_t place = 0,
                                               shm::PortInstance instance = 5) {
    wire::Received announced;
    announced.message.peer = instance;
    announced.message.link = 9;
    announced.message.value = place;
    announced.message.set_name("/hostile");
    announced.descriptors[0] = shm::reopen(output_, O_RDONLY);
    announced.descriptors[1] = shm::reopen(events_.descriptor, O_RDONLY);
    return detail::map_tap_source(announced, {}, shm::Residence::kMapped);
  }
  shm::EventSegment& events() { return *events_; }

 private:
  shm::FileDescriptor output_;
  Written<shm::EventSegment> events_;
};

TapEventKind kind_of(const detail::TapEventData& data) {
  return static_cast<TapEventKind>(data.kind);
}

TEST(AHostilePublisher, WhateverItTellsATapEndsEachLookAndGivesNothingOutsideOfItsMemory) {
  HostilePublisher publisher;
  auto tap = publisher.tap(2);
  std::mt19937_64 random(3);
  std::uint64_t number = 1;
  std::uint64_t taken = 0;
  std::uint64_t read = 0;  // so that samples are read
  const auto pick = [&](std::uint64_t honest) { return random() % 16 == 0 ? random() : honest; };
  for (int round = 0; round < 200'000; ++round) {
    shm::Event& event = publisher.events().events[number % 4];
    const shm::Entry sample = shm::make_entry(number, static_cast<std::uint32_t>(random() % 5));
    event.time.store(static_cast<std::int64_t>(pick(number)));
    event.sample.store(pick(sample));
    event.activity.store(static_cast<std::int64_t>(random()));
    event.generation.store(random());
    event.revision_and_kind.store(pick((random() % 3) << 8 | (1 + random() % 5)));
    event.accepted.store(pick(9));
    event.discarded.store(random());
    event.size.store(pick(8));
    publisher.events().kept[number % 2].store(pick(sample));
    publisher.events().lists[random() % 2].revision.store(2 * (random() % 3));
    publisher.events().lists[random() % 2].count.store(pick(1));
    event.number.store(pick(2 * number));
    ++number;
    detail::TapEventData data;
    if (!tap->take(data)) {
      if (round % 8 == 0) tap = publisher.tap(2);  // the last one may have given it up
      publisher.events().places[0].first.store(pick(number));
      continue;
    }
    ++taken;
    ASSERT_LE(data.context->destinations.size(), std::size_t{shm::kMaxDestinations});
    if (data.data == nullptr) continue;
    ASSERT_LE(data.size, 64u);
    if (data.size != 0) read += std::to_integer<std::uint64_t>(data.data[data.size - 1]);
    tap->give_back(data.hold);
  }
  EXPECT_GT(taken, 10'000u);
  EXPECT_EQ(read, 0u) << "nobody has written there";
}

TEST(AHostilePublisher, IsGivenUpOnceItTellsWhatNoHonestOneDoes) {
  HostilePublisher publisher;
  const auto tap = publisher.tap(1);
  shm::EventWriter writer(publisher.events());
  shm::EventRecord record;
  record.kind = static_cast<shm::EventKind>(99);
  writer.write(record);
  detail::TapEventData data;
  ASSERT_TRUE(tap->take(data));
  EXPECT_EQ(kind_of(data), TapEventKind::closed);
  EXPECT_EQ(data.lost, 1u);
  EXPECT_EQ(tap->misbehaving().size(), 1u);
  EXPECT_TRUE(tap->misbehaving().empty()) << "it is told once";
  record.kind = shm::EventKind::kSignal;
  writer.write(record);
  EXPECT_FALSE(tap->take(data));
  tap->tidy();
  tap->add_source(publisher.map());  // a daemon that has taken over tells of it
  EXPECT_FALSE(tap->take(data)) << "it is read once more";
}

// Such a one may come again and again: what was mapped of it must not stay.
TEST(AHostilePublisher, ThatIsGivenUpIsForgottenOnceItHasGone) {
  HostilePublisher publisher;
  const auto tap = HostilePublisher::lone_tap(1);
  auto source = publisher.map();
  const std::weak_ptr<const detail::TapSource> mapped = source;
  tap->add_source(std::move(source));
  shm::EventRecord record;
  record.kind = static_cast<shm::EventKind>(99);
  shm::EventWriter(publisher.events()).write(record);
  detail::TapEventData data;
  ASSERT_TRUE(tap->take(data));
  tap->lose_source(5, {});
  EXPECT_FALSE(tap->take(data));
  tap->tidy();
  EXPECT_EQ(tap->misbehaving().size(), 1u) << "it is forgotten before it is named";
  tap->tidy();
  EXPECT_FALSE(tap->take(data));
  tap->tidy();
  EXPECT_TRUE(mapped.expired());
}

// What the tap gives of a publisher that tells this between two signals.
TapEventKind told_between(const shm::EventRecord& lie, shm::Nanoseconds before,
                          std::uint64_t lost) {
  HostilePublisher publisher;
  const auto tap = publisher.tap(1);
  shm::EventWriter writer(publisher.events());
  shm::EventRecord honest;
  honest.kind = shm::EventKind::kSignal;
  honest.time = before;
  honest.activity = shm::kForeverFlag | before;
  writer.write(honest);
  writer.write(lie);
  honest.time = shm::monotonic_now();
  writer.write(honest);
  detail::TapEventData data;
  EXPECT_TRUE(tap->take(data));
  EXPECT_EQ(kind_of(data), TapEventKind::signal);
  EXPECT_TRUE(tap->take(data));
  const TapEventKind kind = kind_of(data);
  EXPECT_GE(data.time_ns, before);
  EXPECT_LE(data.time_ns, shm::monotonic_now());
  EXPECT_EQ(data.lost, lost);
  EXPECT_TRUE(tap->take(data));
  EXPECT_EQ(kind_of(data), TapEventKind::signal) << "it goes on behind the lie";
  EXPECT_EQ(tap->lost_events(), lost);
  return kind;
}

constexpr shm::Nanoseconds kMost = std::numeric_limits<shm::Nanoseconds>::max();

TEST(AHostilePublisher, IsNotBelievedATimeThatNoClockHasShown) {
  using shm::EventKind;
  const shm::Nanoseconds before = shm::monotonic_now();
  for (const shm::Nanoseconds time :
       {-kMost - 1, shm::Nanoseconds{-5}, before - 1, shm::kForeverFlag - 1, kMost}) {
    for (const EventKind kind : {EventKind::kSample, EventKind::kSignal, EventKind::kDeactivation,
                                 EventKind::kState, EventKind::kDestinations}) {
      shm::EventRecord lie;
      lie.kind = kind;
      lie.time = time;
      lie.activity = kind == EventKind::kDeactivation ? shm::deactivation(1) : kMost;
      lie.joined = 9;  // of a state
      const bool has_happened = kind != EventKind::kState && kind != EventKind::kDestinations;
      EXPECT_EQ(told_between(lie, before, has_happened ? 1 : 0), TapEventKind::state);
    }
  }
}

TEST(AHostilePublisher, IsNotBelievedAnActivityThatItsEventHasNotMade) {
  using shm::EventKind;
  const shm::Nanoseconds now = shm::monotonic_now();
  const auto told = [&](EventKind kind, shm::ActivityWord activity, std::uint64_t lost) {
    shm::EventRecord record;
    record.kind = kind;
    record.time = now;
    record.activity = activity;
    return told_between(record, now, lost);
  };
  for (const EventKind arrives : {EventKind::kSample, EventKind::kSignal}) {
    for (const shm::ActivityWord word : {shm::kNeverActive, shm::deactivation(now), now}) {
      EXPECT_EQ(told(arrives, word, 1), TapEventKind::state);
    }
    EXPECT_NE(told(arrives, now + 1, 0), TapEventKind::state);
    EXPECT_NE(told(arrives, shm::kForeverFlag | now, 0), TapEventKind::state);
  }
  EXPECT_EQ(told(EventKind::kDeactivation, now + 1, 1), TapEventKind::state);
  EXPECT_EQ(told(EventKind::kDeactivation, shm::deactivation(now), 0), TapEventKind::deactivation);
}

// Each of its events is older than what the other has told.
TEST(AHostilePublisher, DoesNotCrowdOutTheOthersOfATapByOldTimes) {
  HostilePublisher hostile;
  HostilePublisher other;
  const auto tap = HostilePublisher::lone_tap(1);
  tap->add_source(hostile.map());
  tap->add_source(other.map(0, 6));
  shm::EventWriter flood(hostile.events());
  shm::EventRecord old;
  old.kind = shm::EventKind::kSignal;
  old.time = 1;
  old.activity = shm::kForeverFlag | 1;
  shm::EventWriter writer(other.events());
  constexpr int kRounds = 10;
  for (int round = 1; round <= kRounds; ++round) {
    shm::EventRecord record = old;
    record.time = shm::monotonic_now();
    record.generation = static_cast<std::uint64_t>(round);
    writer.write(record);
    detail::TapEventData data;
    int before = 0;
    do {
      flood.write(old);
      ASSERT_TRUE(tap->take(data));
      ASSERT_LE(++before, 16) << "four times what its ring has";
    } while (data.generation == 0);
    EXPECT_EQ(data.generation, static_cast<std::uint64_t>(round));
    EXPECT_EQ(data.lost, 0u);
  }
}

// They would go to terminals and into documents.
TEST(AHostilePublisher, NamesNoDestinationThatCannotBeAPort) {
  for (const std::string name :
       {"/P:i", "", "P:i", "/\x1b[2J\x1b]0;owned\x07/P:i", "/P:i\nforged line", "/\xff",
        "/\xe2\x80\xaeP", "/a b", "/\"P\""}) {
    HostilePublisher publisher;
    const auto tap = publisher.tap(1);
    shm::write_destinations(publisher.events(), 1, {{1, "/fine"}, {2, name}});
    shm::EventRecord record;
    record.kind = shm::EventKind::kSignal;
    record.activity = kMost;
    record.revision = 1;
    record.masks.accepted = 1;
    shm::EventWriter(publisher.events()).write(record);
    detail::TapEventData data;
    ASSERT_TRUE(tap->take(data));
    const bool is_fine = name == "/P:i";
    EXPECT_EQ(data.context->destinations.size(), is_fine ? 2u : 0u) << shm::printable(name);
  }
}

// One byte more than the longest has no end.
TEST(AHostilePublisher, NamesNoDestinationWithoutAnEnd) {
  HostilePublisher publisher;
  const auto tap = publisher.tap(1);
  shm::write_destinations(publisher.events(), 1,
                          {{1, "/" + std::string(shm::kMaxNameLength - 1, 'a')}});
  constexpr std::size_t kWords = shm::DestinationList::kNameWords;
  publisher.events().lists[1].destinations[0].name[kWords - 1].store(0x6161'6161'6161'6161);
  shm::EventRecord record;
  record.kind = shm::EventKind::kSignal;
  record.activity = kMost;
  record.revision = 1;
  shm::EventWriter(publisher.events()).write(record);
  detail::TapEventData data;
  ASSERT_TRUE(tap->take(data));
  EXPECT_TRUE(data.context->destinations.empty());
}

// Killed between stamping and telling: others may have seen the arrival.
TEST(AKilledPublisher, WhoHasStampedWhatItDidNotTellHasLostAnEvent) {
  for (const shm::ActivityWord word : {shm::ActivityWord{70}, shm::ActivityWord{80}}) {
    HostilePublisher publisher;
    const auto tap = publisher.tap(1);
    shm::EventWriter writer(publisher.events());
    shm::EventRecord record;
    record.kind = shm::EventKind::kSignal;
    record.activity = 70;
    writer.write(record);
    tap->lose_source(5, word);
    detail::TapEventData data;
    ASSERT_TRUE(tap->take(data));
    EXPECT_EQ(data.activity, 70);
    ASSERT_TRUE(tap->take(data));
    EXPECT_EQ(data.kind, static_cast<std::uint8_t>(TapEventKind::closed));
    EXPECT_EQ(data.activity, word);
    EXPECT_EQ(data.lost, word == 70 ? 0u : 1u);
    EXPECT_EQ(tap->lost_events(), data.lost);
  }
}

// The end comes after all that was told, however much of it is not for this tap.
TEST(AKilledPublisher, IsReadToItsEnd) {
  HostilePublisher publisher({1024, 2, 2});
  const auto tap = publisher.tap(0);
  shm::EventWriter writer(publisher.events());
  shm::EventRecord record;
  for (int i = 0; i < 200; ++i) writer.write(record);  // states, of other taps
  record.kind = shm::EventKind::kSignal;
  record.activity = 70;
  writer.write(record);
  tap->lose_source(5, {});
  std::vector<int> kinds;
  for (int looks = 0; looks < 10; ++looks) {
    detail::TapEventData data;
    if (tap->take(data)) kinds.push_back(data.kind);
  }
  EXPECT_EQ(kinds, (std::vector<int>{static_cast<int>(TapEventKind::signal),
                                     static_cast<int>(TapEventKind::closed)}));
}

// Who waits is rung for it: nobody else does any more.
TEST(AKilledPublisher, IsReadToItsEndByWhoWaits) {
  HostilePublisher publisher({1024, 2, 2});
  const auto tap = publisher.tap(0);
  shm::EventWriter writer(publisher.events());
  for (int i = 0; i < 1000; ++i) writer.write({});  // states, of other taps
  tap->lose_source(5, {});
  pollfd rung{tap->wait_descriptor(), POLLIN, 0};
  detail::TapEventData data;
  bool is_taken = false;
  while (!is_taken && ::poll(&rung, 1, 0) == 1) is_taken = tap->take(data);
  ASSERT_TRUE(is_taken);
  EXPECT_EQ(kind_of(data), TapEventKind::closed);
}

TEST(AHostilePublisher, WhoseSegmentOfEventsIsNoneIsNotRead) {
  HostilePublisher publisher;
  EXPECT_EQ(error_of([&] { publisher.map(); }), "no error");
  EXPECT_NE(error_of([&] { publisher.map(shm::kMaxTaps); }), "no error");
  publisher.events().header.shape.events = 2048;
  EXPECT_NE(error_of([&] { publisher.map(); }), "no error");
  publisher.events().initialize({4, 2, 2});
  publisher.events().header.version = 7;
  EXPECT_NE(error_of([&] { publisher.map(); }), "no error");
}

}  // namespace
}  // namespace arbiter::test
