// How long samples wait from publish to take, counted in buckets of time: four for each doubling.
#pragma once

#include <bit>
#include <cstddef>
#include <cstdint>

#include "shm/activity.hpp"

namespace arbiter::shm {

inline constexpr std::size_t kLatencyBuckets = 128;

// The first has all below 64 ns, the last all from two minutes on.
constexpr std::size_t latency_bucket(Nanoseconds waited) noexcept {
  if (waited < 64) return 0;
  const auto time = static_cast<std::uint64_t>(waited);
  const auto octave = static_cast<std::size_t>(std::bit_width(time)) - 1;
  const std::size_t bucket = (octave - 6) * 4 + (time >> (octave - 2) & 3) + 1;
  return bucket < kLatencyBuckets ? bucket : kLatencyBuckets - 1;
}

// All in the bucket are below this; of the last, it is a mere number.
constexpr Nanoseconds latency_bound(std::size_t bucket) noexcept {
  if (bucket == 0) return 64;
  const std::size_t octave = (bucket - 1) / 4 + 6;
  return static_cast<Nanoseconds>((bucket - 1) % 4 + 5) << (octave - 2);
}

}  // namespace arbiter::shm
