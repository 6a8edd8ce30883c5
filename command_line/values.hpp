// Values of options on the command line: which there are, said in the same words by all programs.
// CLI11's own checks tell their bounds with the digits of a double, and add them to the help.
#pragma once

#include <algorithm>
#include <charconv>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <sstream>
#include <string>
#include <system_error>
#include <utility>
#include <vector>

#include <CLI/CLI.hpp>

namespace arbiter::command_line {

// "trace, debug or info".
inline std::string alternatives(const std::vector<std::string>& words) {
  std::string text;
  for (std::size_t i = 0; i < words.size(); ++i) {
    if (i > 0) text += i + 1 == words.size() ? " or " : ", ";
    text += words[i];
  }
  return text;
}

// All of the text is one number.
template <class Number>
bool read_number(const std::string& text, Number& value) {
  const char* const end = text.data() + text.size();
  const auto read = std::from_chars(text.data(), end, value);
  return read.ec == std::errc() && read.ptr == end;
}

// Empty: it is one. What has a zero in front CLI11 would take for an octal number.
inline std::string problem_of_whole_number(const std::string& text, std::uint64_t least,
                                           std::uint64_t most, const std::string& range) {
  std::uint64_t value = 0;
  if (!read_number(text, value) || value < least || value > most) {
    return '"' + text + "\" is not a whole number " + range;
  }
  const std::string plain = std::to_string(value);
  return text == plain ? "" : '"' + text + "\" has a zero in front; write " + plain;
}

// CLI::PositiveNumber would tell the bounds of a double, in all their digits.
inline CLI::Validator at_least(std::uint64_t least) {
  return {[least](std::string& text) {
            return problem_of_whole_number(text, least, UINT64_MAX,
                                           "of at least " + std::to_string(least));
          },
          ""};
}
inline CLI::Validator at_least_one() { return at_least(1); }

inline CLI::Validator whole_number_between(std::uint64_t least, std::uint64_t most) {
  return {[least, most](std::string& text) {
            return problem_of_whole_number(
                text, least, most, "from " + std::to_string(least) + " to " + std::to_string(most));
          },
          ""};
}

// CLI::Range lets NaN pass, which is neither below nor above.
inline CLI::Validator number_between(double least, double most) {
  return {[least, most](std::string& text) -> std::string {
            double value = 0;
            const bool is_number = read_number(text, value) && std::isfinite(value);
            if (is_number && value >= least && value <= most) return "";
            std::ostringstream problem;
            problem.precision(10);
            problem << '"' << text << "\" is not a number from " << least << " to " << most;
            return problem.str();
          },
          ""};
}

inline CLI::Validator one_of(std::vector<std::string> words) {
  return {[words = std::move(words)](std::string& text) -> std::string {
            if (std::find(words.begin(), words.end(), text) != words.end()) return "";
            return '"' + text + "\" is not " + alternatives(words);
          },
          ""};
}

// For all options and plain arguments of the program and of its verbs: what a script writes where a
// variable is not set is wrong use, since to go on without it would be to do something else. Call
// it behind all others: a check that an option has of its own speaks first. `may_be_empty`: options
// whose value may be.
inline void refuse_empty(CLI::App& app, const std::vector<std::string>& may_be_empty = {}) {
  for (CLI::Option* const option : app.get_options()) {
    const std::string name = option->get_name();
    const bool takes_one = option->get_items_expected_min() > 0;
    if (!takes_one ||
        std::find(may_be_empty.begin(), may_be_empty.end(), name) != may_be_empty.end()) {
      continue;
    }
    option->check(CLI::Validator(
        [option](std::string& text) -> std::string {
          if (!text.empty()) return "";
          if (option->get_required()) return "is empty; write a value";
          const bool has_type = option->nonpositional() && option->get_type_name() != "TEXT";
          return "is empty; write " + (has_type ? option->get_type_name() : "a value") +
                 ", or leave it out";
        },
        ""));
  }
  for (CLI::App* const verb : app.get_subcommands({})) refuse_empty(*verb, may_be_empty);
}

}  // namespace arbiter::command_line
