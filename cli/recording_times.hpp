// Times of a recording, for people.
#pragma once

#include <string>

#include "evidence/recorded.hpp"

namespace arbiter::cli {

// "+1.500000000 s", since the first arrival; of what was before it, "0.200000000 s before the first
// arrival".
[[nodiscard]] std::string since_first(const evidence::Recorded& recorded, shm::Nanoseconds time);
// "2026-11-22 14:02:41 CET", in this time zone.
[[nodiscard]] std::string wall_text(const evidence::Recorded& recorded, shm::Nanoseconds time);

// A recording's times, by its own clock, and how far they are from those of the wall clock.
struct RecordedTime {
  shm::Nanoseconds begin = 0;
  shm::Nanoseconds end = 0;
  shm::Nanoseconds wall_offset = 0;
};

[[nodiscard]] RecordedTime time_of(const evidence::Recorded& recorded);

// A moment, or all of a second, by the wall clock in this time zone, which was asked for with that
// option. Without a date, the first such time in the recording, or the nearest to it. Throws
// CLI::ValidationError.
[[nodiscard]] evidence::TimeSpan read_time(const std::string& option, const std::string& text,
                                           const RecordedTime& recorded);
// Throws CLI::ValidationError.
void require_within(const std::string& option, const std::string& text,
                    const evidence::TimeSpan& span, const RecordedTime& recorded);
// Both of --at.
[[nodiscard]] evidence::TimeSpan read_moment(const std::string& text, const RecordedTime& recorded);

// Of a time by the wall clock: "2026-11-22 15:02:41.250", in this time zone.
[[nodiscard]] std::string clock_text(shm::Nanoseconds wall);

}  // namespace arbiter::cli
