// The atomics of shm/atomic.hpp, under the explorer's control.
#pragma once

#include <atomic>
#include <cstdint>
#include <cstring>
#include <source_location>

#include "tests/explore/explorer.hpp"

namespace arbiter::shm {

template <class T>
class Atomic {
 public:
  using Where = std::source_location;

  constexpr Atomic() noexcept = default;
  constexpr Atomic(T value) noexcept : value_(value) {}  // NOLINT: as std::atomic
  Atomic(const Atomic&) = delete;
  Atomic& operator=(const Atomic&) = delete;

  T load(std::memory_order order = std::memory_order_seq_cst,
         const Where& where = Where::current()) const noexcept {
    auto* explorer = explore::Explorer::current();
    if (explorer == nullptr) return value_;
    return value_of(explorer->load(this, bits_of(value_), order, where));
  }
  void store(T value, std::memory_order order = std::memory_order_seq_cst,
             const Where& where = Where::current()) noexcept {
    if (auto* explorer = explore::Explorer::current()) {
      explorer->store(this, bits_of(value_), bits_of(value), order, where);
    }
    value_ = value;
  }
  T exchange(T value, std::memory_order order = std::memory_order_seq_cst,
             const Where& where = Where::current()) noexcept {
    auto* explorer = explore::Explorer::current();
    T before = value_;
    if (explorer != nullptr) {
      before = value_of(explorer->begin_update(this, bits_of(value_), order, where));
      explorer->update(this, bits_of(value), order, where);
    }
    value_ = value;
    return before;
  }
  T fetch_add(T by, std::memory_order order = std::memory_order_seq_cst,
              const Where& where = Where::current()) noexcept {
    auto* explorer = explore::Explorer::current();
    T before = value_;
    if (explorer != nullptr) {
      before = value_of(explorer->begin_update(this, bits_of(value_), order, where));
      explorer->update(this, bits_of(before + by), order, where);
    }
    value_ = before + by;
    return before;
  }
  bool compare_exchange_weak(T& expected, T value, std::memory_order success,
                             std::memory_order failure,
                             const Where& where = Where::current()) noexcept {
    auto* explorer = explore::Explorer::current();
    T before = value_;
    if (explorer != nullptr) {
      before = value_of(explorer->begin_update(this, bits_of(value_), failure, where));
    }
    if (before != expected) {
      expected = before;
      return false;
    }
    if (explorer != nullptr) explorer->update(this, bits_of(value), success, where);
    value_ = value;
    return true;
  }
  operator T() const noexcept { return load(); }  // NOLINT: as std::atomic
  T operator=(T value) noexcept {                 // NOLINT: as std::atomic
    store(value);
    return value;
  }

 private:
  static std::uint64_t bits_of(T value) noexcept {
    static_assert(sizeof(T) <= sizeof(std::uint64_t));
    std::uint64_t bits = 0;
    std::memcpy(&bits, &value, sizeof value);
    return bits;
  }
  static T value_of(std::uint64_t bits) noexcept {
    T value;
    std::memcpy(&value, &bits, sizeof value);
    return value;
  }

  alignas(sizeof(T)) T value_;
};

inline void full_fence(const std::source_location& where = std::source_location::current()) {
  if (auto* explorer = explore::Explorer::current()) explorer->full_fence(where);
}
inline void acquire_fence(const std::source_location& where = std::source_location::current()) {
  if (auto* explorer = explore::Explorer::current()) explorer->acquire_fence(where);
}
inline void release_fence(const std::source_location& where = std::source_location::current()) {
  if (auto* explorer = explore::Explorer::current()) explorer->release_fence(where);
}

}  // namespace arbiter::shm
