#include "gateway/core/freshness.hpp"

#include <algorithm>

namespace arbiter::gateway {

StallGuard::Watch& StallGuard::add(const MaxAge& max_age) {
  const std::lock_guard lock(mutex_);
  watches_.push_back(std::make_unique<Watch>(max_age));
  return *watches_.back();
}

shm::Nanoseconds StallGuard::tick(shm::Nanoseconds now, shm::Nanoseconds suspended) {
  shm::Nanoseconds shortest = shm::kForever;
  {
    const std::lock_guard lock(mutex_);
    for (const auto& watch : watches_) shortest = std::min(shortest, watch->max_age_->get());
  }
  const shm::Nanoseconds period =
      std::max(QueueFreshness::period(std::min(shortest, shm::kDefaultTimeout)), kShortestPeriod);
  record_.tick(now, period);
  const shm::Nanoseconds awake = now + suspended;
  if (last_ && awake - *last_ > std::max(shortest, kShortestStop)) {
    stops_.store(stops() + 1, std::memory_order_relaxed);
  }
  last_ = awake;
  return period;
}

}  // namespace arbiter::gateway
