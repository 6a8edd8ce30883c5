// Numbers on the command line.
#pragma once

#include <charconv>
#include <cstdint>
#include <string>
#include <system_error>

#include <CLI/CLI.hpp>

namespace arbiter::cli {

// CLI::PositiveNumber would tell the bounds of a double, in all their digits.
inline CLI::Validator at_least_one() {
  return {[](std::string& text) -> std::string {
            std::uint64_t value = 0;
            const char* const end = text.data() + text.size();
            const auto read = std::from_chars(text.data(), end, value);
            if (read.ec == std::errc() && read.ptr == end && value >= 1) return "";
            return '"' + text + "\" is no whole number of at least 1";
          },
          ""};
}

}  // namespace arbiter::cli
