// The atomics of shm/atomic.hpp with full_fence() left out, to see what it is there for.
#pragma once

#include <atomic>

namespace arbiter::shm {

template <class T>
using Atomic = std::atomic<T>;

// The compiler keeps the order; the processor may not.
inline void full_fence() noexcept { std::atomic_signal_fence(std::memory_order_seq_cst); }
inline void acquire_fence() noexcept { std::atomic_thread_fence(std::memory_order_acquire); }
inline void release_fence() noexcept { std::atomic_thread_fence(std::memory_order_release); }

}  // namespace arbiter::shm
