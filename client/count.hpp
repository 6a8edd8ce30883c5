// Counters in a port's own segment: one writer, so no read-modify-write is needed.
#pragma once

#include <cstdint>

#include "shm/atomic.hpp"

namespace arbiter::detail {

// Relaxed is enough: a counter orders nothing.
inline void count(shm::Atomic<std::uint64_t>& counter, std::uint64_t by = 1) noexcept {
  if (by != 0)
    counter.store(counter.load(std::memory_order_relaxed) + by, std::memory_order_relaxed);
}

}  // namespace arbiter::detail
