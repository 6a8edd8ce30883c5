// Partitions of DDS, by its rules.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

namespace arbiter::gateway {

// Whether two ends have a partition in common. No partition is the one without a name. Names may
// be patterns with `*` and `?`; two patterns have nothing in common. `patience`: bytes that may be
// compared, which become fewer; with none left the answer is true.
[[nodiscard]] bool share_partition(const std::vector<std::string>& a,
                                   const std::vector<std::string>& b, std::size_t& patience);
[[nodiscard]] inline bool share_partition(const std::vector<std::string>& a,
                                          const std::vector<std::string>& b) {
  std::size_t endless = SIZE_MAX;
  return share_partition(a, b, endless);
}

}  // namespace arbiter::gateway
