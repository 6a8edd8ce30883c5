// Times on the command line: 0s, 250ns, 10us, 500ms, 2s, 5min, forever.
#pragma once

#include <cstddef>
#include <string>

#include <CLI/CLI.hpp>

#include "rules/text/duration.hpp"

namespace arbiter::command_line {

inline constexpr const char* kTimeAdvice =
    "write a whole number with a unit (ns, us, ms, s or min), such as 500ms, 2s or 5min";

// Throws CLI::ValidationError, which names the option.
inline shm::Nanoseconds read_time_above_zero(const std::string& option, const std::string& text,
                                             bool takes_forever = true) {
  rules::DurationWords words{"", "is zero", "shorten it", kTimeAdvice};
  words.takes_minutes = true;
  words.takes_forever = takes_forever;
  const auto parsed = rules::parse_duration(text, words);
  if (!parsed.problem.empty()) throw CLI::ValidationError(option, parsed.problem);
  return parsed.value;
}

// The same, which may be zero.
inline shm::Nanoseconds read_time(const std::string& option, const std::string& text,
                                  bool takes_forever = true) {
  const std::size_t unit = text.find_first_not_of('0');
  const bool is_zero = unit != 0 && unit != std::string::npos && text[unit] > '9';
  if (!is_zero) return read_time_above_zero(option, text, takes_forever);
  read_time_above_zero(option, "1" + text.substr(unit));  // the unit is looked at
  return 0;
}

// The same, within bounds.
inline shm::Nanoseconds read_time_within(const std::string& option, const std::string& text,
                                         shm::Nanoseconds least, shm::Nanoseconds most) {
  const shm::Nanoseconds time = read_time(option, text, false);
  if (time >= least && time <= most) return time;
  throw CLI::ValidationError(
      option, "must be " + rules::to_string(least) + " to " + rules::to_string(most));
}

}  // namespace arbiter::command_line
