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

// Of a time by the wall clock: "2026-11-22 15:02:41.250", in this time zone.
[[nodiscard]] std::string clock_text(shm::Nanoseconds wall);

}  // namespace arbiter::cli
