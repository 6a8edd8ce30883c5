#include "link/token_clock.hpp"

#include <chrono>
#include <utility>

namespace arbiter::link {

TokenClock::TokenClock(std::function<void()> tick)
    : tick_(std::move(tick)), thread_([this] { run(); }) {}

TokenClock::~TokenClock() {
  {
    const std::lock_guard lock(mutex_);
    ends_ = true;
  }
  changed_.notify_one();
  thread_.join();
}

void TokenClock::set_period(shm::Nanoseconds period) {
  {
    const std::lock_guard lock(mutex_);
    if (period_ == period) return;
    period_ = period;
  }
  changed_.notify_one();
}

void TokenClock::run() {
  std::unique_lock lock(mutex_);
  while (!ends_) {
    if (period_ == 0) {
      changed_.wait(lock);
      continue;
    }
    lock.unlock();
    tick_();
    lock.lock();
    // One tick too many, where the period has changed, harms nobody.
    if (!ends_) changed_.wait_for(lock, std::chrono::nanoseconds(period_));
  }
}

}  // namespace arbiter::link
