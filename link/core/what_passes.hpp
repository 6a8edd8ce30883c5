// What a link says when it starts: which sources it offers to other hosts, and which it wants from
// them.
#pragma once

#include <string>
#include <vector>

namespace arbiter::link {

// A sentence for the log. It names the first few of each.
[[nodiscard]] std::string what_passes(const std::vector<std::string>& offered,
                                      const std::vector<std::string>& wanted);

}  // namespace arbiter::link
