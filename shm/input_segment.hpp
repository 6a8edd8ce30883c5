// An input port's segment: how far it has read, what it holds, and whether it waits.
//
// The component that has the port open is its one writer; publishers and the daemon read it.
//
//   InputHeader   what the port is; its wait word; what it holds; its counters
//   Lane[kMaxLanes]  one for each publisher that it takes from
#pragma once

#include <cstddef>
#include <cstdint>

#include "shm/atomic.hpp"
#include "shm/latency.hpp"
#include "shm/limits.hpp"
#include "shm/output_segment.hpp"
#include "shm/type_info.hpp"

namespace arbiter::shm {

// As many as a port has sources, and as many again whose publishers have closed or died and that
// have samples left.
inline constexpr std::uint32_t kMaxLanes = 2 * kMaxSourcesPerPort;

// What a receiver holds: {publisher, slot}; 0 is nothing. A hold is announced before the slot is
// read, and the publisher does not use a slot again while it sees one (channel.hpp).
using Hold = std::uint64_t;
constexpr Hold make_hold(PortInstance publisher, std::uint32_t slot) noexcept {
  return publisher << kSlotBits | slot;
}
constexpr PortInstance publisher_of(Hold hold) noexcept { return hold >> kSlotBits; }

struct alignas(kCacheLine) Lane {
  Atomic<PortInstance> publisher;   // 0: unused
  Atomic<std::uint64_t> consumed;   // sequence of the last entry that is done with
  Atomic<std::uint64_t> taken;      // samples given to the component
  Atomic<std::uint64_t> dropped;    // at the take, because the connection was not the winner then
  Atomic<std::uint64_t> overtaken;  // lost to newer ones because the queue was full
  Atomic<std::uint32_t> source;     // id, for status
  Atomic<std::uint64_t> link;       // the number of the link that this is about
};
static_assert(sizeof(Lane) == kCacheLine);

struct InputCounters {
  Atomic<std::uint64_t> taken;
  Atomic<std::uint64_t> dropped;
  Atomic<std::uint64_t> overtaken;
  Atomic<std::uint64_t> blind;       // takes that held back because a source could not be seen yet
  Atomic<std::uint64_t> unsettled;   // takes that found no consistent picture
  Atomic<std::uint64_t> misbehaved;  // entries that no honest publisher writes
  Atomic<std::uint64_t> idles;       // changes to idle that wait_for() told
  Atomic<std::uint64_t> wakes;       // times that a blocked wait_for() was woken
};

struct InputHeader {
  static constexpr std::uint64_t kMagic = 0x31706e69'74696272;
  static constexpr std::uint32_t kVersion = 2;

  std::uint64_t magic;
  std::uint32_t version;
  std::uint32_t depth;
  std::uint32_t max_held;
  std::uint8_t keep;
  std::uint8_t refuse_new;
  std::uint8_t reserved[2];
  TypeInfo type;

  // Odd while the component waits for its bell; each wait has a number of its own, so that a
  // publisher rings once for it. `believed` is the source that the waiting component takes for the
  // winner, or kNone: publishers whose activity begins or ends ring when that is not so any more.
  alignas(kCacheLine) Atomic<std::uint64_t> wait;
  Atomic<SourceId> believed;
  // The newest link that its process has taken up. Numbers of links grow, and the daemon tells of
  // them in that order. If the port keeps all, or is not arbitrated, no publisher begins the queue
  // of a link before.
  Atomic<std::uint64_t> newest_link;

  alignas(kCacheLine) Atomic<Hold> holds[kMaxHeld];
  alignas(kCacheLine) InputCounters counters;
  // Of the samples that were taken while the port was tapped: how long they had waited.
  alignas(kCacheLine) Atomic<std::uint64_t> latencies[kLatencyBuckets];
};

struct InputSegment {
  InputHeader header;
  alignas(kPageSize) Lane lanes[kMaxLanes];

  [[nodiscard]] bool is_consistent() const noexcept {
    return header.magic == InputHeader::kMagic && header.version == InputHeader::kVersion &&
           header.depth >= 1 && header.depth <= kMaxDepth && header.max_held >= 1 &&
           header.max_held <= kMaxHeld;
  }
};
static_assert(sizeof(InputHeader) <= kPageSize);

}  // namespace arbiter::shm
