#include "rules/state_count.hpp"

#include <vector>

namespace arbiter::rules {

StateCount power_of_two(std::size_t exponent) { return StateCount(1) << exponent; }

// Of the states that reach a node, one half goes to each side. What is left to be halved is even
// for as long as there is a variable to decide.
StateCount count_states(const DiagramNodes& function, std::size_t variables) {
  using shm::table::kFalse;
  const StateCount all = power_of_two(variables);
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
