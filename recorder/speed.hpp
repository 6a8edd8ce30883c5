// How fast what was recorded, or a trace, is played.
#pragma once

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <string>

#include "shm/activity.hpp"
#include "shm/clock.hpp"

namespace arbiter::recorder {

// How long it takes at this speed (2: half as long), as far as a clock can go.
inline shm::Nanoseconds at_speed(shm::Nanoseconds span, double speed) {
  if (speed == 1) return span;
  constexpr auto kMost = static_cast<double>(shm::kMaxTime);
  return std::llround(std::clamp(static_cast<double>(span) / speed, -kMost, kMost));
}

// What begins about now and takes so long would not end while a clock goes: throws
// std::runtime_error.
inline void require_end(const std::string& what, shm::Nanoseconds span, double speed) {
  constexpr shm::Nanoseconds kMargin = 1'000'000'000;
  if (at_speed(span, speed) <= shm::kMaxTime - shm::monotonic_now() - kMargin) return;
  throw std::runtime_error(what +
                           " would take more than 70 years at this speed: choose a larger --speed, "
                           "if its times are right");
}

}  // namespace arbiter::recorder
