// The events of an output port, as far as one thread shows them; hostile segments.
#include "shm/event_ring.hpp"

#include <gtest/gtest.h>

#include <memory>

#include "shm/destination_list.hpp"
#include "shm/tap_segment.hpp"

namespace arbiter::shm {
namespace {

constexpr PortInstance kTappedPort = 7;
constexpr EventShape kShape{8, 2, 2};

EventRecord signal_at(Nanoseconds time) {
  EventRecord record;
  record.kind = EventKind::kSignal;
  record.time = time;
  return record;
}

class EventRing : public testing::Test {
 protected:
  EventRing() { segment_->initialize(kShape); }

  EventReader joined(std::uint32_t place = 0, std::uint64_t link = 5) {
    writer().join(place, link);
    EventReader reader(*segment_, kShape, kTappedPort, place, link);
    EXPECT_TRUE(reader.join());
    return reader;
  }
  EventWriter& writer() {
    if (!writer_) writer_ = std::make_unique<EventWriter>(*segment_);
    return *writer_;
  }

  std::unique_ptr<EventSegment> segment_ = std::make_unique<EventSegment>();
  std::unique_ptr<EventWriter> writer_;
  EventRecord record_;
  std::uint64_t lost_ = 0;
};

TEST_F(EventRing, GivesEachEventAsItWasWritten) {
  EventReader reader = joined();
  EventRecord written;
  written.kind = EventKind::kSample;
  written.time = 123;
  written.sample = make_entry(9, 4);
  written.size = 48;
  written.activity = 523;
  written.generation = 3;
  written.revision = 2;
  written.masks = {1, 2, 4, 8};
  writer().write(written, {7, 70});
  ASSERT_EQ(reader.read(record_, lost_), EventReader::Found::kEvent);
  EXPECT_EQ(record_.kind, EventKind::kSample);
  EXPECT_EQ(record_.time, 123);
  EXPECT_EQ(record_.sample, make_entry(9, 4));
  EXPECT_EQ(record_.size, 48u);
  EXPECT_EQ(record_.activity, 523);
  EXPECT_EQ(record_.generation, 3u);
  EXPECT_EQ(record_.revision, 2u);
  EXPECT_EQ(record_.masks.accepted, 1u);
  EXPECT_EQ(record_.masks.discarded, 2u);
  EXPECT_EQ(record_.masks.refused, 4u);
  EXPECT_EQ(record_.masks.blind, 8u);
  EXPECT_EQ(reader.origin().publisher, 7u);
  EXPECT_EQ(reader.origin().sequence, 70u);
  EXPECT_EQ(reader.read(record_, lost_), EventReader::Found::kNothing);
  EXPECT_EQ(lost_, 0u);
}

TEST_F(EventRing, TellsHowManyEventsWereOvertakenAndGoesOnBehindTheLastOfThem) {
  EventReader reader = joined();
  constexpr int kWritten = 100;
  for (int i = 1; i <= kWritten; ++i) writer().write(signal_at(i));
  ASSERT_EQ(reader.read(record_, lost_), EventReader::Found::kGap);
  EXPECT_EQ(record_.time, static_cast<Nanoseconds>(lost_));
  EXPECT_LE(lost_, kWritten - kShape.events / 2);
  std::uint64_t read = 0;
  while (reader.read(record_, lost_) == EventReader::Found::kEvent) ++read;
  EXPECT_EQ(read + lost_, kWritten);
  EXPECT_EQ(record_.time, kWritten);
}

TEST_F(EventRing, TapsThatComeLaterReadFromWhereTheyCame) {
  EventReader first = joined(0, 5);
  writer().write(signal_at(1));
  EventReader second = joined(1, 6);
  writer().write(signal_at(2));
  ASSERT_EQ(second.read(record_, lost_), EventReader::Found::kEvent);
  EXPECT_EQ(record_.time, 2);
  ASSERT_EQ(first.read(record_, lost_), EventReader::Found::kEvent);
  EXPECT_EQ(record_.time, 1);
}

TEST_F(EventRing, NobodyJoinsAtAPlaceThatIsAnothers) {
  writer().join(0, 5);
  EventReader other(*segment_, kShape, kTappedPort, 0, 6);
  EXPECT_FALSE(other.join());
  writer().leave(0);
  EventReader late(*segment_, kShape, kTappedPort, 0, 5);
  EXPECT_FALSE(late.join());
}

TEST_F(EventRing, ASampleIsHeldForAsLongAsItIsKept) {
  const EventReader reader = joined();
  Atomic<Hold> hold{0};
  EXPECT_EQ(writer().keep(make_entry(1, 3)), kNoSlot);
  EXPECT_EQ(writer().keep(make_entry(2, 4)), kNoSlot);
  EXPECT_TRUE(reader.hold(make_entry(1, 3), hold));
  EXPECT_EQ(hold.load(), make_hold(kTappedPort, 3));
  EXPECT_EQ(writer().keep(make_entry(3, 5)), 3u);
  EXPECT_FALSE(reader.hold(make_entry(1, 3), hold));
  EXPECT_EQ(hold.load(), 0u);
  std::vector<std::uint32_t> evicted;
  writer().keep_nothing([&](std::uint32_t slot) { evicted.push_back(slot); });
  EXPECT_EQ(evicted.size(), 2u);
  EXPECT_FALSE(reader.hold(make_entry(3, 5), hold));
}

TEST_F(EventRing, NobodyHoldsASampleOfAPublisherThatHasLetGoOfIt) {
  const EventReader reader = joined();
  Atomic<Hold> hold{0};
  static_cast<void>(writer().keep(make_entry(1, 3)));
  writer().leave(0);
  EXPECT_FALSE(reader.hold(make_entry(1, 3), hold));
  EXPECT_EQ(hold.load(), 0u);
}

// Whatever a publisher that lies writes: each look ends, and what was told to be lost is counted.
TEST_F(EventRing, WhatNoHonestPublisherWritesEndsEachLook) {
  EventReader reader = joined();
  std::uint64_t seed = 1;
  for (int round = 0; round < 20'000; ++round) {
    for (Event& event : segment_->events) {
      seed = seed * 6364136223846793005u + 1442695040888963407u;
      const std::uint64_t near = 2 * reader.next() + (seed >> 60) - 8;
      event.number.store((seed & 1) != 0 ? seed : near);
      if (&event - segment_->events >= static_cast<int>(kShape.events)) break;
    }
    static_cast<void>(reader.read(record_, lost_));
  }
}

TEST_F(EventRing, AShapeThatIsNotSaneIsNone) {
  EXPECT_TRUE(segment_->checked_shape().is_sane());
  for (const EventShape shape :
       {EventShape{0, 2, 2}, EventShape{6, 2, 2}, EventShape{2048, 2, 2}, EventShape{8, 0, 2},
        EventShape{8, 3, 2}, EventShape{8, kMaxKept + 1, 2}, EventShape{8, 2, 0},
        EventShape{8, 2, kMaxDestinationLists + 1}}) {
    segment_->header.shape = shape;
    EXPECT_FALSE(segment_->checked_shape().is_sane());
  }
  segment_->initialize(kShape);
  segment_->header.version = 99;
  EXPECT_FALSE(segment_->checked_shape().is_sane());
}

TEST_F(EventRing, AListOfDestinationsIsReadByItsRevision) {
  const std::string longest(kMaxNameLength, 'x');
  write_destinations(*segment_, 3, {{1, "/a:i"}, {2, "/eight:i"}, {3, longest}, {4, ""}});
  Destinations found;
  ASSERT_TRUE(read_destinations(*segment_, kShape, 3, found));
  EXPECT_EQ(found, (Destinations{{1, "/a:i"}, {2, "/eight:i"}, {3, longest}, {4, ""}}));
  EXPECT_FALSE(read_destinations(*segment_, kShape, 1, found));  // in its place
  EXPECT_FALSE(read_destinations(*segment_, kShape, 4, found));
  write_destinations(*segment_, 5, {{9, "/b:i"}});
  EXPECT_FALSE(read_destinations(*segment_, kShape, 3, found));
  ASSERT_TRUE(read_destinations(*segment_, kShape, 5, found));
  EXPECT_EQ(found, (Destinations{{9, "/b:i"}}));
}

TEST_F(EventRing, AListThatLiesIsBounded) {
  write_destinations(*segment_, 1, {{1, "/a:i"}});
  segment_->lists[1].count.store(UINT64_MAX);
  for (auto& destination : segment_->lists[1].destinations) {
    for (auto& word : destination.name) word.store(UINT64_MAX);
  }
  Destinations found;
  ASSERT_TRUE(read_destinations(*segment_, kShape, 1, found));
  ASSERT_EQ(found.size(), kMaxDestinations);
  EXPECT_LE(found[0].name.size(), kMaxNameLength + 1);
}

}  // namespace
}  // namespace arbiter::shm
