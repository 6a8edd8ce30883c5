// How many states of the sources satisfy a function: exact, whatever the number.
#pragma once

#include <cstddef>
#include <string>

#include <boost/multiprecision/cpp_int.hpp>

#include "rules/prove/diagram.hpp"

namespace arbiter::rules {

using StateCount = boost::multiprecision::cpp_int;

StateCount power_of_two(std::size_t exponent);

// Of all 2^variables; the function depends on these at most.
StateCount count_states(const DiagramNodes& function, std::size_t variables);

std::string to_decimal(const StateCount& count);

}  // namespace arbiter::rules
