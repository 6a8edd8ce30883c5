// A tap whose memory lies to publishers, and a publisher whose memory lies to a tap.
#include <gtest/gtest.h>

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
#include "tests/client/models.hpp"
#include "tests/client/samples.hpp"
#include "tests/support/daemon.hpp"
#include "tests/support/error_of.hpp"
#include "tests/support/raw_port.hpp"

namespace arbiter::test {
namespace {

// A segment that its maker can still write after it is sealed.
template <class Layout>
struct Written {
  Written()
      : descriptor(shm::make_segment("test", sizeof(Layout))),
        mapping(descriptor, sizeof(Layout), shm::Access::kReadWrite) {
    if (shm::allocate(descriptor, 0, sizeof(Layout))) throw std::runtime_error("no memory");
  }
  Layout& operator*() const { return *mapping.as<Layout>(); }
  Layout* operator->() const { return mapping.as<Layout>(); }

  shm::FileDescriptor descriptor;
  shm::Mapping mapping;
};

Written<shm::TapSegment> tap_segment(std::uint32_t max_held) {
  Written<shm::TapSegment> segment;
  segment->magic = shm::TapSegment::kMagic;
  segment->version = shm::TapSegment::kVersion;
  segment->max_held = max_held;
  segment->sleeps = 1;
  shm::seal(segment.descriptor, shm::Seals::kOneWriter);
  return segment;
}

TEST(AHostileTap, HoldsUpNobodyAndTakesNoSlotThatIsNotItsOwn) {
  Daemon daemon(single_model());
  Node node("test");
  OutputPortOptions options;
  options.max_memory = 64 * 8;  // two loans, a copy; 5 for the receiver
  auto out = node.output_port<Number>("/out", options);
  auto in = node.input_port<Number>("/in", {.depth = 4, .max_held = 1});
  RawClient client(daemon.instance());
  client.hello("hostile");
  const auto segment = tap_segment(shm::kMaxTapHeld);
  const shm::Bell bell;
  client.send(RawClient::message(wire::MessageKind::kOpenTap, "/out"),
              {segment.descriptor.get(), bell.for_publishers().get()});
  const auto publisher = client.expect(wire::MessageKind::kTapSource).message.peer;
  std::mt19937_64 random(7);
  for (std::int64_t i = 0; i < 20'000; ++i) {
    for (auto& hold : segment->holds) {
      const auto slot = static_cast<std::uint32_t>(random() % 256);
      hold.store(random() % 8 == 0 ? random() : shm::make_hold(publisher, slot));
    }
    segment->wait.store(random());
    segment->max_held = static_cast<std::uint32_t>(random());
    ASSERT_EQ(out.publish(Number{i}).delivered, 1u);
    ASSERT_EQ(take_from(in), i);
  }
  EXPECT_EQ(daemon.source("/out")["no_slot"], 0);
}

TEST(AHostileTap, WhoseSegmentIsNoneIsRefused) {
  Daemon daemon(single_model());
  Node node("test");
  auto out = node.output_port<Number>("/out");
  const shm::Bell bell;
  const auto refusal = [&](const shm::FileDescriptor& segment) {
    RawClient client(daemon.instance());
    client.hello("hostile");
    client.send(RawClient::message(wire::MessageKind::kOpenTap, "/out"),
                {segment.get(), bell.for_publishers().get()});
    return error_of([&] { client.expect(wire::MessageKind::kOpened); });
  };
  EXPECT_NE(refusal(raw_input_segment()).find("not a tap's of this version"), std::string::npos);
  const Written<shm::TapSegment> unsealed;
  EXPECT_NE(refusal(unsealed.descriptor), "no error");
  // What the daemon does not look into, the publisher does.
  for (const std::uint32_t max_held : {shm::kMaxTapHeld + 1, UINT32_MAX}) {
    RawClient client(daemon.instance());
    client.hello("hostile");
    const auto segment = tap_segment(max_held);
    client.send(RawClient::message(wire::MessageKind::kOpenTap, "/out"),
                {segment.descriptor.get(), bell.for_publishers().get()});
    const auto refused = client.expect(wire::MessageKind::kConnectionRefused);
    EXPECT_EQ(refused.message.text_view(), "the tap's segment is not one of this version");
  }
}

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
  std::shared_ptr<const detail::TapSource> map(std::uint32_t place = 0) {
    wire::Received announced;
    announced.message.peer = 5;
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

std::shared_ptr<const detail::TapPeer> tap_of(shm::PortInstance number, uid_t user,
                                              std::uint32_t max_held, bool is_privileged = false) {
  auto peer = std::make_shared<detail::TapPeer>();
  peer->instance = number;
  peer->identity.inode = number;
  peer->user = user;
  peer->is_privileged = is_privileged;
  peer->max_held = max_held;
  return peer;
}

// How many taps a user gets, each of which may hold so much.
int taps_for(detail::TapSeats& seats, uid_t user, std::uint32_t max_held,
             bool is_privileged = false) {
  static shm::PortInstance last = 0;
  int count = 0;
  while (error_of([&] {
           seats.add(tap_of(++last, user, max_held, is_privileged), "/out", 128,
                     shm::Residence::kMapped);
         }) == "no error") {
    ++count;
  }
  return count;
}

TEST(TapsOfSeveralUsers, LeaveSomethingForEachOther) {
  detail::TapSeats seats;
  EXPECT_EQ(taps_for(seats, 1001, 0), 7) << "two of sixteen are kept, and half of the rest";
  EXPECT_EQ(taps_for(seats, 1002, 0), 3);
  EXPECT_EQ(taps_for(seats, 1003, 0), 2);
  EXPECT_EQ(taps_for(seats, 1004, 0), 1);
  EXPECT_EQ(taps_for(seats, 0, 0, true), 3) << "all that are left";
  EXPECT_EQ(taps_for(seats, 1005, 0), 0);
}

TEST(TapsOfSeveralUsers, ShareWhatMayBeHeld) {
  detail::TapSeats seats;
  EXPECT_EQ(taps_for(seats, 1001, 14), 2) << "28 of 64, of which eight are kept";
  EXPECT_EQ(taps_for(seats, 1002, 14), 1);
  EXPECT_EQ(taps_for(seats, 0, 14, true), 1);
}

TEST(TapsOfSeveralUsers, SayWhoseShareIsUsedUp) {
  detail::TapSeats seats;
  EXPECT_EQ(taps_for(seats, 1001, 0), 7);
  EXPECT_EQ(error_of([&] { seats.add(tap_of(99, 1001, 0), "/out", 128, shm::Residence::kMapped); }),
            "/out has 7 taps already, of 16 (kMaxTaps); user 1001 has 7 of them, and may have no "
            "more than is left for others");
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
