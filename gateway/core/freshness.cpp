#include "gateway/core/freshness.hpp"

#include <algorithm>

namespace arbiter::gateway {

StallGuard::Watch& StallGuard::add(const MaxAge& max_age) {
  const std::lock_guard lock(mutex_);
  watches_.push_back(std::make_unique<Watch>(max_age));
  return *watches_.back();
}

shm::Nanoseconds StallGuard::tick(shm::Nanoseconds now) {
  const shm::Nanoseconds last = last_tick_.load(std::memory_order_relaxed);
  const shm::Nanoseconds expected = period_.load(std::memory_order_relaxed);
  // Before the first tick nothing is in time, and nothing can have waited since before that.
  const bool is_first = last == -shm::kMaxTime;
  shm::Nanoseconds shortest = shm::kDefaultTimeout;
  {
    const std::lock_guard lock(mutex_);
    for (const auto& watch : watches_) {
      const shm::Nanoseconds max_age = watch->max_age_->get();
      shortest = std::min(shortest, max_age);
      if (is_first || now - last <= expected + max_age / 2) continue;
      // Relaxed is enough: the release below makes it seen by whoever sees this tick.
      watch->late_until_.store(now + max_age, std::memory_order_relaxed);
    }
  }
  const shm::Nanoseconds period =
      std::max<shm::Nanoseconds>(QueueFreshness::period(shortest), kShortestPeriod);
  period_.store(period, std::memory_order_relaxed);
  // Release: who sees this tick sees what it has found, and the period that it expects.
  last_tick_.store(now, std::memory_order_release);
  return period;
}

// `now` was read before the call, so that a tick that comes in between makes nothing late.
shm::Nanoseconds StallGuard::deadline(const Watch& watch, shm::Nanoseconds now) const noexcept {
  // Acquire; pairs with the release in tick().
  const shm::Nanoseconds last = last_tick_.load(std::memory_order_acquire);
  const shm::Nanoseconds max_age = watch.max_age_->get();
  const shm::Nanoseconds expected = period_.load(std::memory_order_relaxed);
  if (now - last > expected + max_age / 2) return kLate;
  if (now < watch.late_until_.load(std::memory_order_relaxed)) return kLate;
  return last + max_age;
}

}  // namespace arbiter::gateway
