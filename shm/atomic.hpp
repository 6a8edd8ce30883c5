// The one alias through which this project names atomics.
//
// A test that explores interleavings compiles the very same headers over atomics that a scheduler
// controls: it defines ARBITER_ATOMICS_HEADER as a header that provides the names below.
#pragma once

#ifdef ARBITER_ATOMICS_HEADER
#include ARBITER_ATOMICS_HEADER
#else

#include <atomic>
#include <cstdint>

namespace arbiter::shm {

template <class T>
using Atomic = std::atomic<T>;

// Orders everything before it against everything after it, stores against later loads included.
// Each call site names the fence that it pairs with.
inline void full_fence() noexcept { std::atomic_thread_fence(std::memory_order_seq_cst); }
inline void acquire_fence() noexcept { std::atomic_thread_fence(std::memory_order_acquire); }
inline void release_fence() noexcept { std::atomic_thread_fence(std::memory_order_release); }

static_assert(std::atomic<std::uint64_t>::is_always_lock_free,
              "words shared between processes need address-free, lock-free atomics");
static_assert(std::atomic<std::uint32_t>::is_always_lock_free);

}  // namespace arbiter::shm

#endif
