// The atomics of shm/atomic.hpp, with a seam at each operation.
#pragma once

#include <atomic>
#include <cstring>

#include "tests/fuzz/segments/seam.hpp"

namespace arbiter::shm {

template <class T>
class Atomic {
 public:
  constexpr Atomic() noexcept = default;
  constexpr Atomic(T value) noexcept : value_(value) {}  // NOLINT: as std::atomic
  Atomic(const Atomic&) = delete;
  Atomic& operator=(const Atomic&) = delete;

  T load(std::memory_order order = std::memory_order_seq_cst) const noexcept {
    const T value = value_.load(order);
    if (fuzz::Seam::current == nullptr) return value;
    fuzz::Seam::current->before_operation();
    std::uint64_t bits = 0;
    const T now = value_.load(order);
    std::memcpy(&bits, &now, sizeof now);
    bits = fuzz::Seam::current->load(this, bits, sizeof(T));
    T result;
    std::memcpy(&result, &bits, sizeof result);
    return result;
  }
  void store(T value, std::memory_order order = std::memory_order_seq_cst) noexcept {
    if (fuzz::Seam::current != nullptr) fuzz::Seam::current->before_operation();
    value_.store(value, order);
  }
  T exchange(T value, std::memory_order order = std::memory_order_seq_cst) noexcept {
    return value_.exchange(value, order);
  }
  bool compare_exchange_weak(T& expected, T value, std::memory_order success,
                             std::memory_order failure) noexcept {
    return value_.compare_exchange_weak(expected, value, success, failure);
  }
  operator T() const noexcept { return load(); }  // NOLINT: as std::atomic
  T operator=(T value) noexcept {                 // NOLINT: as std::atomic
    store(value);
    return value;
  }

 private:
  static_assert(sizeof(T) <= sizeof(std::uint64_t));
  std::atomic<T> value_{};
};

inline void full_fence() noexcept { std::atomic_thread_fence(std::memory_order_seq_cst); }
inline void acquire_fence() noexcept { std::atomic_thread_fence(std::memory_order_acquire); }
inline void release_fence() noexcept { std::atomic_thread_fence(std::memory_order_release); }

}  // namespace arbiter::shm
