#include "rules/prove/state_count.hpp"

#include <algorithm>
#include <vector>

namespace arbiter::rules {

StateCount power_of_two(std::size_t exponent) { return StateCount(1) << exponent; }

// Of the states that reach a node, one half goes to each side. What is left to be halved is even
// for as long as there is a variable to decide.
StateCount count_states(const DiagramNodes& function, std::size_t variables) {
  using shm::table::kFalse;
  const StateCount all = power_of_two(variables);
  // A conjunction says something of each of its variables, and nothing of the others.
  if (!function.nodes.empty() &&
      std::all_of(function.nodes.begin(), function.nodes.end(),
                  [](const auto& node) { return node.low == kFalse || node.high == kFalse; })) {
    return power_of_two(variables - function.nodes.size());
  }
  std::vector<StateCount> counts(function.nodes.size());
  const auto of = [&](shm::Word node) -> StateCount {
    if (node < kFalse) return counts[node];
    return node == kFalse ? StateCount(0) : all;
  };
  for (std::size_t i = function.nodes.size(); i-- > 0;) {
    counts[i] = (of(function.nodes[i].low) + of(function.nodes[i].high)) >> 1;
  }
  return of(function.root);
}

std::string to_decimal(const StateCount& count) { return count.str(); }

}  // namespace arbiter::rules
