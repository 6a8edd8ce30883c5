// Times of a recording, for people.
#pragma once

#include <string>

#include "evidence/recorded.hpp"

namespace arbiter::cli {

// "+1.500000000 s", since the first arrival; of what was before it, "0.200000000 s before the first
// arrival".
[[nodiscard]] std::string since_first(const evidence::Recorded& recorded, shm::Nanoseconds time);
// "2026-11-22 14:02:41 UTC".
[[nodiscard]] std::string wall_text(const evidence::Recorded& recorded, shm::Nanoseconds time);

// From the first moment to before the second, by the clock of the recording.
struct TimeSpan {
  shm::Nanoseconds from = 0;
  shm::Nanoseconds to = 0;
};

// What was asked for with --at: a moment, or all of a second, by the wall clock in this time zone;
// without a date, the first such time from `begin` on. `begin` and `end` are the recording's, by
// its own clock. Throws CLI::ValidationError.
[[nodiscard]] TimeSpan read_moment(const std::string& text, shm::Nanoseconds begin,
                                   shm::Nanoseconds end, shm::Nanoseconds wall_offset);

// Of a time by the wall clock: "2026-11-22 15:02:41.250", in this time zone.
[[nodiscard]] std::string clock_text(shm::Nanoseconds wall);

}  // namespace arbiter::cli
