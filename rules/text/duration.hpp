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

// How a refusal speaks of what was written: as a source's timeout, unless the caller has others.
struct DurationWords {
  std::string_view subject = "the timeout ";
  std::string_view zero = "is zero, so that its source would never be active";
  std::string_view shorten = "shorten it, or write forever";
  std::string_view advice =
      "write a whole number with a unit, such as 250ns, 10us, 500ms or 2s, or forever";
  bool takes_minutes = false;  // 5min, on a command line: a model has none, and is told 300s
  bool takes_forever = true;
};

// A whole number from 1 on with a unit right behind it, or shm::kForever where `forever` is taken.
ParsedDuration parse_duration(std::string_view text, const DurationWords& words = {});

// In the largest unit that has no fraction.
std::string to_string(shm::Nanoseconds timeout);

}  // namespace arbiter::rules
