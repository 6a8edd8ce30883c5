// A tap's segment: what it holds, and whether it waits.
//
// The program that watches is its one writer; the publishers that it watches read it.
#pragma once

#include <cstddef>
#include <cstdint>

#include "shm/atomic.hpp"
#include "shm/event_segment.hpp"
#include "shm/input_segment.hpp"
#include "shm/limits.hpp"

namespace arbiter::shm {

struct alignas(kPageSize) TapSegment {
  static constexpr std::uint64_t kMagic = 0x31706174'74696272;
  static constexpr std::uint32_t kVersion = 1;

  std::uint64_t magic;
  std::uint32_t version;
  std::uint32_t max_held;  // 0: it reads no samples
  std::uint32_t sleeps;    // 0: it never waits for its bell, and publishers need not look
  // Odd while it waits for its bell; each wait has a number of its own, so that a publisher rings
  // once for it.
  alignas(kCacheLine) Atomic<std::uint64_t> wait;
  alignas(kCacheLine) Atomic<Hold> holds[kMaxTapHeld];

  [[nodiscard]] bool is_consistent() const noexcept {
    return magic == kMagic && version == kVersion && max_held <= kMaxTapHeld;
  }
};
static_assert(sizeof(TapSegment) == kPageSize);

}  // namespace arbiter::shm
