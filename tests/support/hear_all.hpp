// Waiting until a node has taken up what others have done.
#pragma once

#include <atomic>
#include <string>

#include <arbiter/arbiter.hpp>

namespace arbiter::test {

// One that no model mentions, and nobody has or closes meanwhile.
inline std::string name_of_nobody() {
  static std::atomic<int> names{0};
  return "/name/of/nobody" + std::to_string(++names);
}

// What somebody else opens, taps or loads is there after 0.2 s even if this node's service thread
// has not run. But what a node is told comes before the answer to what it asks next.
inline void hear_all(Node& node) { static_cast<void>(node.output_port<int>(name_of_nobody())); }

}  // namespace arbiter::test
