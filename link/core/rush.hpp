// Whether somebody who takes what comes had better stay awake.
//
// To be woken takes longer than to send several samples. So while things come one right after
// another, who sends them does not sleep in between, but gives way to whoever can run. That costs
// the rest of a processor: therefore only where they come so fast that most of one is used anyway,
// and not for a burst of a few.
//
// Units: nanoseconds of a monotonic clock, given. Thread safety: none of its own.
#pragma once

#include <algorithm>

#include "shm/activity.hpp"

namespace arbiter::link {

class Rush {
 public:
  // What comes later than that after the rest began ends it.
  static constexpr shm::Nanoseconds kGap = 20'000;
  // It begins when so many in turn have come sooner.
  static constexpr unsigned kMany = 8;

  // Something has come.
  void come(shm::Nanoseconds now) noexcept {
    count_ = now - rested_ < kGap ? std::min(count_ + 1, kMany) : 0;
  }
  // All that has come is done.
  void rest(shm::Nanoseconds now) noexcept { rested_ = now; }
  [[nodiscard]] bool lasts(shm::Nanoseconds now) const noexcept {
    return count_ == kMany && now - rested_ < kGap;
  }

 private:
  shm::Nanoseconds rested_ = -kGap;
  unsigned count_ = 0;
};

}  // namespace arbiter::link
