// Numbers and times on the command line.
#pragma once

#include <charconv>
#include <cmath>
#include <cstdint>
#include <sstream>
#include <string>
#include <system_error>

#include <CLI/CLI.hpp>

#include "command_line/durations.hpp"

namespace arbiter::cli {

// CLI::PositiveNumber would tell the bounds of a double, in all their digits.
inline CLI::Validator at_least_one() {
  return {[](std::string& text) -> std::string {
            std::uint64_t value = 0;
            const char* const end = text.data() + text.size();
            const auto read = std::from_chars(text.data(), end, value);
            if (read.ec == std::errc() && read.ptr == end && value >= 1) return "";
            return '"' + text + "\" is not a whole number of at least 1";
          },
          ""};
}

// CLI::Range lets NaN pass, which is neither below nor above.
inline CLI::Validator number_between(double least, double most) {
  return {[least, most](std::string& text) -> std::string {
            double value = 0;
            const char* const end = text.data() + text.size();
            const auto read = std::from_chars(text.data(), end, value);
            const bool is_number = read.ec == std::errc() && read.ptr == end;
            if (is_number && std::isfinite(value) && value >= least && value <= most) return "";
            std::ostringstream problem;
            problem.precision(10);
            problem << '"' << text << "\" is not a number from " << least << " to " << most;
            return problem.str();
          },
          ""};
}

// Times are the same for all programs.
using command_line::read_time;
using command_line::read_time_above_zero;

}  // namespace arbiter::cli
