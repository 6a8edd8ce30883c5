// How long a demo lasts, as its command line says it.
#pragma once

#include <string>

#include <CLI/CLI.hpp>

namespace search_and_track {

// CLI::Range takes "nan": it is neither below nor above anything.
[[nodiscard]] inline CLI::Validator seconds_between(double least, double most) {
  const CLI::Range range(least, most);
  return {[range, least, most](std::string& text) {
            double value = 0;
            const bool is_number = CLI::detail::lexical_cast(text, value) && value == value;
            return is_number
                       ? range(text)
                       : text + " is not a number of seconds from " +
                             CLI::detail::to_string(least) + " to " + CLI::detail::to_string(most);
          },
          range.get_description()};
}

}  // namespace search_and_track
