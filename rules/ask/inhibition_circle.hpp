// Circles of connections that keep each other out.
#pragma once

#include <cstddef>
#include <functional>
#include <vector>

#include "rules/prove/budget.hpp"
#include "rules/prove/proof.hpp"

namespace arbiter::rules {

using Circle = std::vector<std::size_t>;  // each is kept out by the next, the last by the first

// A circle that is not passed over. `keeps_out[i]`: those that win only while `i` is inactive.
// Empty: there is none, or enough were passed over. Throws StepLimit.
Circle find_circle(std::vector<VariableSet> keeps_out, Budget& budget,
                   const std::function<bool(const Circle&)>& is_passed_over);

}  // namespace arbiter::rules
