#include "shm/channel.hpp"

#include <gtest/gtest.h>

#include <cstdlib>
#include <cstring>
#include <memory>

namespace arbiter::shm {
namespace {

constexpr PortInstance kPublisher = 5, kReceiver = 7, kOther = 9;

// An output port's segment in plain memory.
class Channels : public testing::Test {
 protected:
  Channels() : layout_(plan()), memory_(std::aligned_alloc(kPageSize, layout_.total_size)) {
    std::memset(memory_.get(), 0, layout_.total_size);
    segment_ = OutputSegment(static_cast<std::byte*>(memory_.get()), layout_);
  }
  static OutputLayout plan() {
    TypeInfo type;
    type.size = 8;
    return OutputLayout::plan(type, 100);
  }

  ChannelWriter join(std::uint32_t depth, PortInstance receiver = kReceiver,
                     std::uint32_t index = 0) {
    ChannelWriter writer(segment_, index);
    writer.join(receiver, 1, depth);
    return writer;
  }
  ChannelReader reader(PortInstance receiver = kReceiver) {
    return ChannelReader(segment_, kPublisher, receiver);
  }
  static void push(ChannelWriter& writer, std::uint32_t slot) {
    static_cast<void>(writer.push(slot));
  }
  // Takes the oldest entry; its slot, or kNoSlot.
  static std::uint32_t take(ChannelReader& reader, std::uint64_t& lost) {
    const Entry entry = reader.peek(lost);
    if (entry == 0) return kNoSlot;
    Atomic<Hold> hold{0};
    if (!reader.hold(entry, hold)) return kNoSlot;
    EXPECT_EQ(hold.load(), make_hold(kPublisher, slot_of(entry)));
    ChannelReader::release(hold);
    reader.consume();
    return slot_of(entry);
  }

  struct Free {
    void operator()(void* memory) const { std::free(memory); }
  };
  OutputLayout layout_;
  std::unique_ptr<void, Free> memory_;
  OutputSegment segment_;
};

TEST_F(Channels, AQueueGivesItsSamplesInOrderAndThenNothing) {
  ChannelWriter writer = join(4);
  ChannelReader receiver = reader();
  ASSERT_TRUE(receiver.join());
  std::uint64_t lost = 0;
  EXPECT_EQ(take(receiver, lost), kNoSlot);
  for (std::uint32_t slot = 10; slot < 14; ++slot) EXPECT_EQ(writer.push(slot), kNoSlot);
  for (std::uint32_t slot = 10; slot < 14; ++slot) EXPECT_EQ(take(receiver, lost), slot);
  EXPECT_EQ(take(receiver, lost), kNoSlot);
  EXPECT_EQ(lost, 0u);
}

TEST_F(Channels, DepthAndLossesAreExactHoweverManyComeBetweenTakes) {
  for (std::uint32_t depth = 1; depth <= 5; ++depth) {
    for (std::uint32_t pushes = 0; pushes <= 3 * depth + 2; ++pushes) {
      ChannelWriter writer = join(depth, kReceiver, depth);
      ChannelReader receiver = reader();
      ASSERT_TRUE(receiver.join());
      std::uint32_t evictions = 0;
      std::uint64_t lost = 0;
      push(writer, 99);
      ASSERT_EQ(take(receiver, lost), 99u);  // not at the beginning of the ring
      for (std::uint32_t i = 0; i < pushes; ++i) evictions += writer.push(i) != kNoSlot;
      EXPECT_EQ(evictions, pushes + 1 > depth ? pushes + 1 - depth : 0);
      const std::uint32_t kept = std::min(pushes, depth);
      EXPECT_EQ(receiver.backlog(receiver.backlog_end()), kept);
      for (std::uint32_t i = pushes - kept; i < pushes; ++i) EXPECT_EQ(take(receiver, lost), i);
      EXPECT_EQ(take(receiver, lost), kNoSlot);
      EXPECT_EQ(lost, pushes - kept);
      writer.leave([](std::uint32_t) {});
    }
  }
}

TEST_F(Channels, EachSlotThatWentInComesOutOnceByEvictionOrWhenTheQueueEnds) {
  for (std::uint32_t depth = 1; depth <= 4; ++depth) {
    for (std::uint32_t pushes = 0; pushes <= 9; ++pushes) {
      ChannelWriter writer = join(depth);
      std::vector<int> out(pushes, 0);
      for (std::uint32_t slot = 0; slot < pushes; ++slot) {
        const std::uint32_t evicted = writer.push(slot);
        if (evicted != kNoSlot) ++out[evicted];
      }
      writer.leave([&](std::uint32_t slot) { ++out[slot]; });
      for (const int times : out) EXPECT_EQ(times, 1);
    }
  }
}

TEST_F(Channels, WhatAReceiverIsDoneWithComesOutOnceHoweverFarItIs) {
  for (std::uint32_t depth = 1; depth <= 4; ++depth) {
    for (std::uint32_t pushes = 0; pushes <= 9; ++pushes) {
      for (std::uint32_t done = 0; done <= pushes; ++done) {
        ChannelWriter writer = join(depth, kReceiver, 0);
        const std::uint64_t before = writer.accepted();
        std::vector<int> out(pushes + depth, 0);
        const auto count = [&](std::uint32_t slot) { ++out[slot]; };
        const auto push_and_count = [&](std::uint32_t slot) {
          if (const std::uint32_t evicted = writer.push(slot); evicted != kNoSlot) count(evicted);
        };
        for (std::uint32_t slot = 0; slot < pushes; ++slot) push_and_count(slot);
        const Atomic<std::uint64_t> consumed{before + done};
        writer.forget(consumed, count);
        writer.forget(consumed, count);
        for (std::uint32_t slot = 0; slot < pushes; ++slot) {
          const bool is_overtaken = slot + depth < pushes;
          EXPECT_EQ(out[slot], slot < done || is_overtaken ? 1 : 0) << slot << " of " << pushes;
        }
        // The rest comes out as if nothing had been forgotten.
        for (std::uint32_t slot = pushes; slot < pushes + depth; ++slot) push_and_count(slot);
        writer.leave(count);
        for (const int times : out) EXPECT_EQ(times, 1);
      }
    }
  }
}

TEST_F(Channels, AReceiverThatLiesAboutHowFarItIsTakesNothingOut) {
  ChannelWriter writer = join(3);
  push(writer, 1);
  for (const std::uint64_t lie : {writer.accepted() + 1, UINT64_MAX, kSequenceMask}) {
    const Atomic<std::uint64_t> consumed{lie};
    writer.forget(consumed, [](std::uint32_t slot) { ADD_FAILURE() << slot; });
  }
}

TEST_F(Channels, OneThatIsNotNamedHasNoQueue) {
  join(4, kOther);
  ChannelReader receiver = reader();
  EXPECT_FALSE(receiver.join());
  std::uint64_t lost = 0;
  EXPECT_EQ(receiver.peek(lost), 0u);
  join(4, kReceiver, 63);
  EXPECT_TRUE(receiver.join());
}

// A receiver restarts: its successor must find none of what the predecessor had in its queue, nor
// take the beginning of its own for something old.
TEST_F(Channels, AChannelUsedAgainGivesOnlyWhatCameForTheNewReceiver) {
  for (std::uint32_t before = 1; before <= 6; ++before) {
    for (std::uint32_t after = 1; after <= 6; ++after) {
      {
        ChannelWriter writer = join(before);
        for (std::uint32_t slot = 0; slot < 7; ++slot) push(writer, slot);
        writer.leave([](std::uint32_t) {});
      }
      ChannelWriter writer = join(after, kOther);  // as a port does: a new writer for a new queue
      ChannelReader receiver = reader(kOther);
      ASSERT_TRUE(receiver.join());
      std::uint64_t lost = 0;
      ASSERT_EQ(take(receiver, lost), kNoSlot) << before << " -> " << after;
      push(writer, 50);
      EXPECT_EQ(take(receiver, lost), 50u);
      EXPECT_EQ(lost, 0u);
      EXPECT_EQ(receiver.state(), ChannelReader::State::kJoined);
      writer.leave([](std::uint32_t) {});
    }
  }
}

TEST_F(Channels, NoHoldIsTakenOnceTheQueueHasEnded) {
  ChannelWriter writer = join(2);
  ChannelReader receiver = reader();
  ASSERT_TRUE(receiver.join());
  push(writer, 3);
  std::uint64_t lost = 0;
  const Entry entry = receiver.peek(lost);
  ASSERT_NE(entry, 0u);
  writer.leave([](std::uint32_t) {});
  Atomic<Hold> hold{0};
  EXPECT_FALSE(receiver.hold(entry, hold));
  EXPECT_EQ(hold.load(), 0u) << "what was announced is taken back";
  EXPECT_EQ(receiver.state(), ChannelReader::State::kLeft);
}

TEST_F(Channels, NoHoldIsTakenOnAnEntryThatWasOvertaken) {
  ChannelWriter writer = join(1);
  ChannelReader receiver = reader();
  ASSERT_TRUE(receiver.join());
  push(writer, 3);
  std::uint64_t lost = 0;
  const Entry entry = receiver.peek(lost);
  EXPECT_EQ(writer.push(4), 3u);
  Atomic<Hold> hold{0};
  EXPECT_FALSE(receiver.hold(entry, hold));
  EXPECT_EQ(hold.load(), 0u);
  EXPECT_EQ(take(receiver, lost), 4u);
  EXPECT_EQ(lost, 1u);
}

TEST_F(Channels, AQueueIsFullWhenDepthSamplesWait) {
  ChannelWriter writer = join(3);
  for (std::uint64_t i = 0; i < 3; ++i) {
    EXPECT_FALSE(writer.is_full(0));
    push(writer, 0);
  }
  EXPECT_TRUE(writer.is_full(0));
  EXPECT_FALSE(writer.is_full(1));
  EXPECT_FALSE(writer.is_full(100)) << "a receiver that lies is not refused anything";
}

// What no honest publisher writes.

TEST_F(Channels, APublisherThatNamesAnImpossibleDepthIsGivenUp) {
  for (const std::uint32_t depth : {0u, kMaxDepth + 1, UINT32_MAX}) {
    ChannelWriter writer = join(depth);
    ChannelReader receiver = reader();
    EXPECT_FALSE(receiver.join());
    EXPECT_EQ(receiver.state(), ChannelReader::State::kMisbehaved);
    std::uint64_t lost = 0;
    EXPECT_EQ(receiver.peek(lost), 0u);
    writer.leave([](std::uint32_t) {});
  }
}

TEST_F(Channels, APublisherThatNamesASlotItDoesNotHaveIsGivenUp) {
  ChannelWriter writer = join(2);
  ChannelReader receiver = reader();
  ASSERT_TRUE(receiver.join());
  push(writer, 100);
  std::uint64_t lost = 0;
  EXPECT_EQ(receiver.peek(lost), 0u);
  EXPECT_EQ(receiver.state(), ChannelReader::State::kMisbehaved);
}

TEST_F(Channels, APublisherThatJumpsByAnotherStepThanItsDepthIsGivenUp) {
  ChannelWriter writer = join(4);
  ChannelReader receiver = reader();
  ASSERT_TRUE(receiver.join());
  push(writer, 1);
  segment_.ring(0, kReceiver)[0] = make_entry(1 + 6, 1);
  std::uint64_t lost = 0;
  EXPECT_EQ(receiver.peek(lost), 0u);
  EXPECT_EQ(receiver.state(), ChannelReader::State::kMisbehaved);
}

TEST_F(Channels, GarbageInARingNeverLeadsOutsideItAndEveryLookEnds) {
  for (const std::uint32_t depth : {1u, 2u, 3u, kMaxDepth}) {
    for (const Entry garbage : {Entry{1}, ~Entry{0}, make_entry(kSequenceMask / 2, 0),
                                make_entry(kSequenceMask / 2 + 2, 0), make_entry(1 + depth, 0),
                                make_entry(1 + 1000 * std::uint64_t{depth}, 99)}) {
      ChannelWriter writer = join(depth);
      ChannelReader receiver = reader();
      ASSERT_TRUE(receiver.join());
      for (std::uint32_t i = 0; i < kMaxDepth; ++i) segment_.ring(0, kReceiver)[i] = garbage;
      segment_.channel(0).accepted = garbage;
      std::uint64_t lost = 0;
      for (int looks = 0; looks < 10; ++looks) {
        const Entry entry = receiver.peek(lost);
        EXPECT_LT(slot_of(entry), layout_.slot_count);
        EXPECT_LE(receiver.backlog(receiver.backlog_end()), depth);
        if (entry != 0) receiver.consume();
      }
      for (std::uint32_t i = 0; i < kMaxDepth; ++i) segment_.ring(0, kReceiver)[i] = 0;
      segment_.channel(0).accepted = 0;
      writer.leave([](std::uint32_t) {});
    }
  }
}

TEST_F(Channels, SequencesPassTheEndOfTheirBits) {
  segment_.channel(0).accepted = kSequenceMask - 2;
  ChannelWriter writer = join(3);
  ChannelReader receiver = reader();
  ASSERT_TRUE(receiver.join());
  std::uint64_t lost = 0;
  for (std::uint32_t slot = 0; slot < 9; ++slot) {
    push(writer, slot);
    EXPECT_EQ(take(receiver, lost), slot);
  }
  EXPECT_EQ(lost, 0u);
}

// In releases too (shm/assertion.hpp).
using ChannelsDeathTest = Channels;
TEST_F(ChannelsDeathTest, AQueueBeginsOnlyWhereNoOtherIs) {
  ChannelWriter writer = join(2);
  push(writer, 1);
  EXPECT_DEATH(join(2, kOther), "a mistake in the program: a queue begins where another has not");
  writer.leave([](std::uint32_t) {});
  join(2, kOther);
}

}  // namespace
}  // namespace arbiter::shm
