// Counting instructions: what stands between the two requests, and nothing else, goes into a part
// of callgrind's output that bears the measure's name.
#pragma once

#include <valgrind/callgrind.h>

#include <string>

namespace arbiter::bench {

inline constexpr int kTimes = 5000;  // of what takes few instructions

inline std::string part_name(const std::string& measure, int times) {
  return measure + " * " + std::to_string(times);
}

// `times` calls of `operate`, after enough of them that queues are full and pools go round.
template <class Operation>
void count_after(int warm_up, const std::string& measure, int times, Operation operate) {
  for (int i = 0; i < warm_up; ++i) operate();
  const std::string part = part_name(measure, times);
  CALLGRIND_TOGGLE_COLLECT;
  for (int i = 0; i < times; ++i) operate();
  CALLGRIND_TOGGLE_COLLECT;
  CALLGRIND_DUMP_STATS_AT(part.c_str());
}

void count_decisions();

}  // namespace arbiter::bench
