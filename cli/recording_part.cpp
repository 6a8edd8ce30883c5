#include "cli/recording_part.hpp"

#include <algorithm>

#include <CLI/CLI.hpp>

#include "rules/text/names.hpp"

namespace arbiter::cli {

std::vector<CLI::Option*> add_part_options(CLI::App& verb, PartOptions& options) {
  auto* const from = verb.add_option("--from", options.from,
                                     "Only what happened from this time of day on, in your time "
                                     "zone (TZ): 14:03:07, 14:03:07.250, '2026-11-22 14:03:07'")
                         ->type_name("TIME");
  auto* const to = verb.add_option("--to", options.to,
                                   "Only what happened before this time of day; without a date, "
                                   "the first such time from the beginning of the part on")
                       ->type_name("TIME");
  return {from, to};
}

evidence::TimeSpan read_part(const PartOptions& options, const RecordedTime& recorded) {
  evidence::TimeSpan part;
  RecordedTime rest = recorded;
  if (!options.from.empty()) {
    part.from = read_time("--from", options.from, recorded).from;
    require_within("--from", options.from, {part.from, shm::kForever}, recorded);
    part.from = rest.begin = std::max(recorded.begin, part.from);
  }
  if (options.to.empty()) return part;
  part.to = read_time("--to", options.to, rest).from;
  require_within("--to", options.to, {0, part.to}, recorded);
  if (part.to > part.from) return part;
  throw CLI::ValidationError("--to", rules::quote(options.to) + " is not after --from");
}

}  // namespace arbiter::cli
