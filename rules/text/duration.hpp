// Timeouts as they are written: 250ns, 10us, 500ms, 2s, forever.
#pragma once

#include <string>
#include <string_view>

#include "shm/activity.hpp"

namespace arbiter::rules {

struct ParsedDuration {
  shm::Nanoseconds value = 0;
  std::string problem;  // what is wrong and what to do; empty if nothing is
};

// A whole number from 1 on with a unit right behind it, or shm::kForever.
ParsedDuration parse_duration(std::string_view text);

}  // namespace arbiter::rules
