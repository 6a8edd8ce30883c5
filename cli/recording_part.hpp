// A part of a recording, chosen by the time of day.
#pragma once

#include <string>
#include <vector>

#include "cli/recording_times.hpp"

namespace CLI {
class App;
class Option;
}  // namespace CLI

namespace arbiter::cli {

struct PartOptions {
  std::string from;  // empty: from its beginning
  std::string to;    // empty: to its end

  [[nodiscard]] bool is_all() const { return from.empty() && to.empty(); }
};

// --from and --to, which are returned.
std::vector<CLI::Option*> add_part_options(CLI::App& verb, PartOptions& options);

// Throws CLI::ValidationError.
[[nodiscard]] evidence::TimeSpan read_part(const PartOptions& options,
                                           const RecordedTime& recorded);

}  // namespace arbiter::cli
