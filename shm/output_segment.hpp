// An output port's segment: the samples, and one queue of them for each input port.
//
// The component that has the port open is its one writer; receivers and the daemon read it.
//
//   OutputHeader                          one page
//   Channel[kMaxDestinations]             one cache line each
//   Entry[kMaxDestinations][kMaxDepth]    the channels' rings
//   SlotHeader[slot_count]
//   payload[slot_count], `stride` bytes each, from the next page on
//
// The whole is reserved when the port is opened and sealed to that size; memory is allocated as
// input ports connect, for no more slots than they can need (slot_pool.hpp).
//
// A sample lies in one slot, and is never copied: a channel's ring holds entries {sequence, slot}.
// One word is one entry. Storing entry n puts sample n into the queue and, where the ring is full,
// takes sample n - depth out of it by the same store.
#pragma once

#include <cstddef>
#include <cstdint>

#include "shm/activity.hpp"
#include "shm/atomic.hpp"
#include "shm/ids.hpp"
#include "shm/limits.hpp"
#include "shm/type_info.hpp"

namespace arbiter::shm {

// An entry of a ring. Sequences count a channel's accepted samples from 1, so 0 is "never written".
using Entry = std::uint64_t;
inline constexpr int kSlotBits = 16;
inline constexpr std::uint64_t kSequenceMask = (std::uint64_t{1} << 48) - 1;

constexpr Entry make_entry(std::uint64_t sequence, std::uint32_t slot) noexcept {
  return sequence << kSlotBits | slot;
}
constexpr std::uint64_t sequence_of(Entry entry) noexcept { return entry >> kSlotBits; }
constexpr std::uint32_t slot_of(Entry entry) noexcept {
  return static_cast<std::uint32_t>(entry & ((1u << kSlotBits) - 1));
}

// Where a sample began that its publisher passes on: one life of a source on another host, and the
// sample's sequence there. `publisher` 0: it began here.
struct SampleOrigin {
  std::uint64_t publisher = 0;
  std::uint64_t sequence = 0;
};

// A line of its own: a receiver reads one while the publisher writes the next.
struct alignas(kCacheLine) SlotHeader {
  Atomic<std::uint64_t> sequence;  // of the source: counts its samples from 1
  Atomic<Nanoseconds> stamp;       // arrival time
  Atomic<std::uint64_t> size;      // bytes of the sample
  // Only samples that are passed on write these. So they say of which sample they are, by its
  // sequence: another one has no origin.
  Atomic<std::uint64_t> origin_of;
  Atomic<std::uint64_t> origin_publisher;
  Atomic<std::uint64_t> origin_sequence;

  // Relaxed is enough for both: the slot's samples are ordered by its entries (channel.hpp).
  void set_origin(std::uint64_t of, SampleOrigin origin) noexcept {
    origin_of.store(of, std::memory_order_relaxed);
    origin_publisher.store(origin.publisher, std::memory_order_relaxed);
    origin_sequence.store(origin.sequence, std::memory_order_relaxed);
  }
  [[nodiscard]] SampleOrigin origin() const noexcept {
    const std::uint64_t of = origin_of.load(std::memory_order_relaxed);
    if (of == 0 || of != sequence.load(std::memory_order_relaxed)) return {};
    return {origin_publisher.load(std::memory_order_relaxed),
            origin_sequence.load(std::memory_order_relaxed)};
  }
};
static_assert(sizeof(SlotHeader) == kCacheLine);

// Written by the publisher. `receiver` is the number of the link whose queue this is (the daemon
// gives each another); it is written last when an input port joins and first, to 0, when it leaves
// (channel.hpp). What every publish writes is kept apart from what every take reads.
struct alignas(kCacheLine) Channel {
  Atomic<PortInstance> receiver;
  Atomic<std::uint64_t> first;  // sequence of the first entry that is this receiver's
  Atomic<std::uint32_t> depth;  // entries in use of the ring
  Atomic<std::uint32_t> port;   // id of the input port, for status
  // Sequence of the last entry; never reset.
  alignas(kCacheLine) Atomic<std::uint64_t> accepted;
  Atomic<std::uint64_t> discarded;  // by the decision; this and the next since `receiver` joined
  Atomic<std::uint64_t> refused;    // because the queue was full (refuse_new)
};
static_assert(sizeof(Channel) == 2 * kCacheLine);

// Room for a ring. Where in it the ring begins depends on the link: at one place in all segments,
// the rings that a receiver polls would compete for the few cache lines that the address's low bits
// lead to.
inline constexpr std::size_t kRingBytes = sizeof(Atomic<Entry>) * kMaxDepth + kPageSize;

struct OutputCounters {
  Atomic<std::uint64_t> published;  // samples given to publish()
  Atomic<std::uint64_t> signals;    // arrivals without a sample
  Atomic<std::uint64_t> delivered;  // summed over input ports, as the next three
  Atomic<std::uint64_t> discarded;
  Atomic<std::uint64_t> refused;
  Atomic<std::uint64_t> blind;      // discarded because a source could not be seen yet
  Atomic<std::uint64_t> unsettled;  // discarded because no consistent picture could be taken
  Atomic<std::uint64_t> no_slot;    // loan() found none: more samples are held than were allowed
  Atomic<std::uint64_t> late;       // no arrivals: their deadlines had passed
};

struct OutputHeader {
  static constexpr std::uint64_t kMagic = 0x31747562'74696272;
  static constexpr std::uint32_t kVersion = 3;

  std::uint64_t magic;
  std::uint32_t version;
  std::uint32_t slot_count;      // reserved, not all allocated
  std::uint64_t stride;          // bytes from one payload to the next
  std::uint64_t headers_offset;  // of SlotHeader[0]
  std::uint64_t payload_offset;  // of payload[0]
  std::uint64_t total_size;
  TypeInfo type;
  // How often an input port has joined: one that waits to be joined looks at this word alone.
  alignas(kCacheLine) Atomic<std::uint64_t> joins;
  alignas(kCacheLine) OutputCounters counters;
};
static_assert(sizeof(OutputHeader) <= kPageSize);

// The header and the channels: what whoever only watches a port needs of its segment.
inline constexpr std::size_t kOutputHeadBytes = kPageSize + sizeof(Channel) * kMaxDestinations;

// Where everything lies in a segment; a reader checks a foreign one with is_consistent().
struct OutputLayout {
  std::uint64_t channels_offset = kPageSize;
  std::uint64_t rings_offset = kOutputHeadBytes;
  std::uint64_t headers_offset = rings_offset + kRingBytes * kMaxDestinations;
  std::uint64_t payload_offset = 0;
  std::uint64_t stride = 0;
  std::uint32_t slot_count = 0;
  std::uint64_t total_size = 0;

  static OutputLayout plan(const TypeInfo& type, std::uint32_t slots) noexcept {
    const auto round_up = [](std::uint64_t value, std::uint64_t to) {
      return (value + to - 1) / to * to;
    };
    OutputLayout layout;
    const std::uint64_t unit = type.alignment > kCacheLine ? type.alignment : kCacheLine;
    layout.stride = round_up(type.size == 0 ? 1 : type.size, unit);
    layout.slot_count = slots;
    layout.payload_offset =
        round_up(layout.headers_offset + sizeof(SlotHeader) * std::uint64_t{slots}, kPageSize);
    layout.total_size = round_up(layout.payload_offset + layout.stride * slots, kPageSize);
    return layout;
  }

  // The layout that a header tells, if a segment of `size` bytes can hold it; else one of size 0.
  // `type`: a copy of the header's, for its writer may change it at any time: what is believed of
  // the type must be what the layout was computed with.
  static OutputLayout checked(const OutputHeader& header, const TypeInfo& type,
                              std::uint64_t size) noexcept {
    const std::uint32_t slots = header.slot_count;
    const bool sane = header.magic == OutputHeader::kMagic &&
                      header.version == OutputHeader::kVersion && slots != 0 &&
                      slots <= kMaxSlots && (type.alignment != 0 || type.is_variable()) &&
                      type.alignment <= kMaxAlignment &&
                      (type.alignment & (type.alignment - 1)) == 0 && type.size <= size;
    if (!sane) return {};
    const OutputLayout layout = plan(type, slots);
    return layout.total_size == size ? layout : OutputLayout{};
  }
  static OutputLayout checked(const OutputHeader& header, std::uint64_t size) noexcept {
    const TypeInfo type = header.type;
    return checked(header, type, size);
  }
};

// The parts of a mapped segment, for its writer and for its readers.
class OutputSegment {
 public:
  OutputSegment() = default;
  OutputSegment(std::byte* base, const OutputLayout& layout) noexcept
      : base_(base), layout_(layout) {}

  [[nodiscard]] OutputHeader& header() const noexcept {
    return *reinterpret_cast<OutputHeader*>(base_);
  }
  [[nodiscard]] Channel& channel(std::uint32_t index) const noexcept {
    return reinterpret_cast<Channel*>(base_ + layout_.channels_offset)[index];
  }
  // The channel's ring, for a link.
  [[nodiscard]] Atomic<Entry>* ring(std::uint32_t channel, PortInstance link) const noexcept {
    const std::size_t place = link % (kPageSize / kCacheLine) * kCacheLine;
    return reinterpret_cast<Atomic<Entry>*>(base_ + layout_.rings_offset +
                                            kRingBytes * std::size_t{channel} + place);
  }
  [[nodiscard]] SlotHeader& slot_header(std::uint32_t slot) const noexcept {
    return reinterpret_cast<SlotHeader*>(base_ + layout_.headers_offset)[slot];
  }
  [[nodiscard]] std::byte* payload(std::uint32_t slot) const noexcept {
    return base_ + layout_.payload_offset + layout_.stride * slot;
  }
  [[nodiscard]] const OutputLayout& layout() const noexcept { return layout_; }
  [[nodiscard]] bool exists() const noexcept { return base_ != nullptr; }

 private:
  std::byte* base_ = nullptr;
  OutputLayout layout_;
};

}  // namespace arbiter::shm
