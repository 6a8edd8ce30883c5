// This node's clock, and the two ways in which a decision reads it.
#pragma once

#include <time.h>

#include "shm/activity.hpp"

namespace arbiter::shm {

// CLOCK_MONOTONIC in nanoseconds. About 28 ns by way of the vDSO.
inline Nanoseconds monotonic_now() noexcept {
  timespec time{};
  clock_gettime(CLOCK_MONOTONIC, &time);
  return Nanoseconds{time.tv_sec} * 1'000'000'000 + time.tv_nsec;
}

// A reading to decide by. `reading` starts as given: fresh where it was taken for this decision,
// else as a lower bound of the time (decision.hpp says what that saves).
class DecisionClock {
 public:
  DecisionClock(Nanoseconds reading, bool fresh) noexcept : reading_(reading), fresh_(fresh) {}

  [[nodiscard]] Nanoseconds reading() const noexcept { return reading_; }
  [[nodiscard]] bool is_fresh() const noexcept { return fresh_; }
  void read() noexcept {
    reading_ = monotonic_now();
    fresh_ = true;
  }

 private:
  Nanoseconds reading_;
  bool fresh_;
};

// A time that does not pass: for what-if questions and for traces.
class FixedClock {
 public:
  explicit FixedClock(Nanoseconds time) noexcept : time_(time) {}

  [[nodiscard]] Nanoseconds reading() const noexcept { return time_; }
  [[nodiscard]] static bool is_fresh() noexcept { return true; }
  static void read() noexcept {}

 private:
  Nanoseconds time_;
};

}  // namespace arbiter::shm
