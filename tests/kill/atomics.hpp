// The atomics of shm/atomic.hpp, with a point to be killed at before each operation.
#pragma once

#include <atomic>

#include "tests/kill/points.hpp"

namespace arbiter::shm {

// Laid out as std::atomic: the daemon and other components use the very same memory.
template <class T>
class Atomic {
 public:
  constexpr Atomic() noexcept = default;
  constexpr Atomic(T value) noexcept : value_(value) {}  // NOLINT: as std::atomic
  Atomic(const Atomic&) = delete;
  Atomic& operator=(const Atomic&) = delete;

  T load(std::memory_order order = std::memory_order_seq_cst) const noexcept {
    kill::pass_point();
    return value_.load(order);
  }
  void store(T value, std::memory_order order = std::memory_order_seq_cst) noexcept {
    kill::pass_point();
    value_.store(value, order);
  }
  T exchange(T value, std::memory_order order = std::memory_order_seq_cst) noexcept {
    kill::pass_point();
    return value_.exchange(value, order);
  }
  bool compare_exchange_weak(T& expected, T value, std::memory_order success,
                             std::memory_order failure) noexcept {
    kill::pass_point();
    return value_.compare_exchange_weak(expected, value, success, failure);
  }
  operator T() const noexcept { return load(); }  // NOLINT: as std::atomic
  T operator=(T value) noexcept {                 // NOLINT: as std::atomic
    store(value);
    return value;
  }

 private:
  std::atomic<T> value_{};
};
static_assert(sizeof(Atomic<std::uint64_t>) == sizeof(std::atomic<std::uint64_t>));

inline void full_fence() noexcept {
  kill::pass_point();
  std::atomic_thread_fence(std::memory_order_seq_cst);
}
inline void acquire_fence() noexcept {
  kill::pass_point();
  std::atomic_thread_fence(std::memory_order_acquire);
}
inline void release_fence() noexcept {
  kill::pass_point();
  std::atomic_thread_fence(std::memory_order_release);
}

}  // namespace arbiter::shm
