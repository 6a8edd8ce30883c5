// So many a time, and no more: for messages that strangers may cause.
//
// Thread safety: any thread.
#pragma once

#include <cstdint>
#include <mutex>
#include <optional>

#include "shm/activity.hpp"
#include "shm/clock.hpp"

namespace arbiter::gateway::dds {

class Quota {
 public:
  // `most` within `period`.
  constexpr Quota(std::uint32_t most, shm::Nanoseconds period) noexcept
      : most_(most), period_(period) {}

  // Empty: not now. Otherwise how many were not let through since the last one that was.
  [[nodiscard]] std::optional<std::uint64_t> take() noexcept { return take(shm::monotonic_now()); }
  [[nodiscard]] std::optional<std::uint64_t> take(shm::Nanoseconds now) noexcept {
    const std::lock_guard lock(mutex_);
    if (!take_one(now)) {
      ++refused_;
      return std::nullopt;
    }
    const std::uint64_t refused = refused_;
    refused_ = 0;
    return refused;
  }
  // For what is tried again where it was not let through: it takes one, and counts nothing.
  [[nodiscard]] bool take_without_count(shm::Nanoseconds now) noexcept {
    const std::lock_guard lock(mutex_);
    return take_one(now);
  }

 private:
  bool take_one(shm::Nanoseconds now) noexcept {
    if (taken_ == 0 || now - begin_ >= period_) {
      begin_ = now;
      taken_ = 0;
    }
    if (taken_ >= most_) return false;
    ++taken_;
    return true;
  }

  const std::uint32_t most_;
  const shm::Nanoseconds period_;
  std::mutex mutex_;
  shm::Nanoseconds begin_ = 0;
  std::uint32_t taken_ = 0;
  std::uint64_t refused_ = 0;
};

}  // namespace arbiter::gateway::dds
