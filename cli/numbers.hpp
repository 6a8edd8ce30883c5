// Numbers and times on the command line.
#pragma once

#include <charconv>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <sstream>
#include <string>
#include <system_error>

#include <CLI/CLI.hpp>

#include "rules/text/duration.hpp"

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

inline constexpr const char* kTimeAdvice =
    "write a whole number with a unit (ns, us, ms or s), such as 500ms or 2s";

// Throws CLI::ValidationError, which names the option. `advice`: how to write a time there.
inline shm::Nanoseconds read_time_above_zero(const std::string& option, const std::string& text,
                                             const char* advice = kTimeAdvice) {
  const auto parsed = rules::parse_duration(text, {"", "is zero", "shorten it", advice});
  if (!parsed.problem.empty()) throw CLI::ValidationError(option, parsed.problem);
  return parsed.value;
}

// 0s, 250ns, 10us, 500ms, 2s, forever. Throws CLI::ValidationError.
inline shm::Nanoseconds read_time(const std::string& option, const std::string& text,
                                  const char* advice = kTimeAdvice) {
  const std::size_t unit = text.find_first_not_of('0');
  const bool is_zero = unit != 0 && unit != std::string::npos && text[unit] > '9';
  if (!is_zero) return read_time_above_zero(option, text, advice);
  read_time_above_zero(option, "1" + text.substr(unit), advice);  // the unit is looked at
  return 0;
}

}  // namespace arbiter::cli
