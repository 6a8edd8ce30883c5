// Numbers and times on the command line: the same for all programs.
#pragma once

#include "command_line/durations.hpp"
#include "command_line/values.hpp"

namespace arbiter::cli {

using command_line::at_least;
using command_line::at_least_one;
using command_line::number_between;
using command_line::one_of;
using command_line::read_time;
using command_line::read_time_above_zero;
using command_line::read_time_within;
using command_line::whole_number_between;

}  // namespace arbiter::cli
