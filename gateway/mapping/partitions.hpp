// Partitions of DDS, by its rules.
#pragma once

#include <string>
#include <vector>

namespace arbiter::gateway {

// Whether two ends have a partition in common. No partition is the one without a name. Names may
// be patterns with `*` and `?`; two patterns have nothing in common.
[[nodiscard]] bool share_partition(const std::vector<std::string>& a,
                                   const std::vector<std::string>& b);

}  // namespace arbiter::gateway
