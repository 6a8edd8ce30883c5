// The clock of this machine, which is that of all hosts of a test.
#pragma once

#include <time.h>

#include <cstdint>

namespace arbiter::failures {

using Nanoseconds = std::int64_t;
inline constexpr Nanoseconds kMs = 1'000'000;
inline constexpr Nanoseconds kSecond = 1000 * kMs;

// CLOCK_MONOTONIC.
[[nodiscard]] inline Nanoseconds now() noexcept {
  timespec time{};
  ::clock_gettime(CLOCK_MONOTONIC, &time);
  return time.tv_sec * kSecond + time.tv_nsec;
}

}  // namespace arbiter::failures
