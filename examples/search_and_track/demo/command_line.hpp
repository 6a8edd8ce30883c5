// The command line of a demo, and what its main() makes of it.
#pragma once

#include <exception>
#include <iostream>
#include <string>

#include <CLI/CLI.hpp>

namespace search_and_track {

// How long it lasts. CLI::Range takes "nan": it is neither below nor above anything.
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

// The exit code of `run`, which is called if the command line is right; 2, or 0 after --help.
template <class Run>
int parse_and_run(CLI::App& app, int argc, const char* const* argv, const Run& run) {
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    return app.exit(error) == 0 ? 0 : 2;
  }
  return run();
}

// For main(): the exit code of `run`, from its options on; 1 if it throws, and `program` says why.
template <class Run>
int exit_code_of(const char* program, const Run& run) {
  try {
    return run();
  } catch (const std::exception& error) {
    std::cerr << program << ": " << error.what() << '\n';
    return 1;
  }
}

}  // namespace search_and_track
