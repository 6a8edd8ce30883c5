#include "shm/output_segment.hpp"

#include <gtest/gtest.h>

#include <functional>

#include "shm/input_segment.hpp"

namespace arbiter::shm {
namespace {

TypeInfo type_of(std::uint64_t size, std::uint64_t alignment) {
  TypeInfo type;
  type.size = size;
  type.alignment = alignment;
  return type;
}

TEST(OutputLayout, PartsFollowEachOtherWithoutOverlapAndAligned) {
  for (const std::uint64_t size : {0u, 1u, 8u, 64u, 65u, 4096u, 100'000u}) {
    for (const std::uint64_t alignment : {1u, 8u, 64u, 128u, 4096u}) {
      for (const std::uint32_t slots : {1u, 5u, 1000u, kMaxSlots}) {
        const auto layout = OutputLayout::plan(type_of(size, alignment), slots);
        EXPECT_GE(layout.channels_offset, sizeof(OutputHeader));
        EXPECT_GE(layout.rings_offset, layout.channels_offset + sizeof(Channel) * kMaxDestinations);
        EXPECT_GE(layout.headers_offset, layout.rings_offset + kRingBytes * kMaxDestinations);
        EXPECT_GE(layout.payload_offset, layout.headers_offset + sizeof(SlotHeader) * slots);
        EXPECT_GE(layout.total_size, layout.payload_offset + layout.stride * slots);
        EXPECT_GE(layout.stride, size);
        EXPECT_EQ(layout.payload_offset % alignment, 0u);
        EXPECT_EQ(layout.stride % alignment, 0u);
        EXPECT_EQ(layout.total_size % kPageSize, 0u);
      }
    }
  }
}

class OutputHeaderCheck : public testing::Test {
 protected:
  OutputHeaderCheck() {
    fill();
    size_ = OutputLayout::plan(header_.type, 9).total_size;
  }
  void fill() {
    header_.magic = OutputHeader::kMagic;
    header_.version = OutputHeader::kVersion;
    header_.slot_count = 9;
    header_.type = type_of(100, 8);
  }
  [[nodiscard]] bool accepted() const {
    return OutputLayout::checked(header_, size_).total_size != 0;
  }

  OutputHeader header_{};
  std::uint64_t size_ = 0;
};

TEST_F(OutputHeaderCheck, AcceptsWhatAnHonestPublisherWrites) { EXPECT_TRUE(accepted()); }

TEST_F(OutputHeaderCheck, TakesTheLayoutFromTheSizesNeverFromTheOffsetsInTheHeader) {
  header_.stride = 1u << 30;
  header_.headers_offset = UINT64_MAX;
  header_.payload_offset = UINT64_MAX - 7;
  header_.total_size = 1;
  const auto layout = OutputLayout::checked(header_, size_);
  EXPECT_EQ(layout.total_size, size_);
  EXPECT_LE(layout.payload_offset + layout.stride * layout.slot_count, size_);
}

TEST_F(OutputHeaderCheck, RejectsEveryFieldThatIsOutOfItsBounds) {
  const std::vector<std::pair<const char*, std::function<void(OutputHeader&)>>> corruptions = {
      {"magic", [](OutputHeader& h) { h.magic ^= 1; }},
      {"version", [](OutputHeader& h) { ++h.version; }},
      {"no slots", [](OutputHeader& h) { h.slot_count = 0; }},
      {"more slots than there are", [](OutputHeader& h) { h.slot_count = 1000; }},
      {"too many slots", [](OutputHeader& h) { h.slot_count = kMaxSlots + 1; }},
      {"all slots", [](OutputHeader& h) { h.slot_count = UINT32_MAX; }},
      {"no alignment", [](OutputHeader& h) { h.type.alignment = 0; }},
      {"an odd alignment", [](OutputHeader& h) { h.type.alignment = 24; }},
      {"a large alignment", [](OutputHeader& h) { h.type.alignment = 2 * kPageSize; }},
      {"all bits of alignment", [](OutputHeader& h) { h.type.alignment = UINT64_MAX; }},
      {"a larger sample", [](OutputHeader& h) { h.type.size = 1'000'000; }},
      {"a sample of all memory", [](OutputHeader& h) { h.type.size = UINT64_MAX; }},
      {"a sample that wraps", [](OutputHeader& h) { h.type.size = UINT64_MAX - 62; }},
  };
  for (const auto& [name, corrupt] : corruptions) {
    corrupt(header_);
    EXPECT_FALSE(accepted()) << name;
    fill();
  }
  EXPECT_TRUE(accepted());
}

TEST_F(OutputHeaderCheck, RejectsASegmentOfAnyOtherSize) {
  for (const std::uint64_t other : {std::uint64_t{0}, size_ - kPageSize, size_ + kPageSize}) {
    EXPECT_EQ(OutputLayout::checked(header_, other).total_size, 0u);
  }
}

TEST(Entry, HoldsASequenceAndASlotApart) {
  for (const std::uint64_t sequence : {std::uint64_t{0}, std::uint64_t{1}, kSequenceMask}) {
    for (const std::uint32_t slot : {0u, 1u, kMaxSlots}) {
      const Entry entry = make_entry(sequence, slot);
      EXPECT_EQ(sequence_of(entry), sequence);
      EXPECT_EQ(slot_of(entry), slot);
    }
  }
}

TEST(Hold, HoldsAPublisherAndASlotApartAndIsNeverNothing) {
  const Hold hold = make_hold(1, 0);
  EXPECT_NE(hold, 0u);
  EXPECT_EQ(publisher_of(make_hold(kSequenceMask, kMaxSlots)), kSequenceMask);
  EXPECT_EQ(slot_of(make_hold(7, 9)), 9u);
}

}  // namespace
}  // namespace arbiter::shm
