// What taps have seen, against what publishers wrote down of the same calls. Checked of each tap:
//   - each arrival and deactivation is seen once, in its order, and is of the kind that it was
//   - what is missing between two that are seen is no more than what the tap was told to have lost,
//     and that is more only by events that are no arrivals
//   - each sample that could be read is the one that was published, whole
//   - it met the fates that publish() returned
//   - nothing is missing at the end: of a publisher that was killed, nothing but the call during
//     which it was killed
#pragma once

#include <cstdint>

#include "tests/stress/plan.hpp"
#include "tests/stress/records.hpp"

namespace arbiter::stress {

struct TapsChecked {
  std::uint64_t events = 0;
  std::uint64_t lost = 0;
};

// Failures are told to the records.
TapsChecked check_taps(const Plan& plan, Records& records);

}  // namespace arbiter::stress
