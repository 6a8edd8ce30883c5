// What decides differently under another model, as far as a daemon can tell without keeping those
// who wait for it.
#pragma once

#include <stop_token>
#include <string>

#include <nlohmann/json_fwd.hpp>

#include "rules/compile.hpp"

namespace arbiter::service {

// One line, for the log and the history. Both throw rules::Stopped.
[[nodiscard]] std::string summary_of_changes(const rules::CompiledModel& before,
                                             const rules::CompiledModel& after,
                                             const std::stop_token& stop);
// {"text", "diff"}: all of it, as `arbiter diff` and `arbiter diff --json` show it.
[[nodiscard]] nlohmann::json changes_json(const rules::CompiledModel& before,
                                          const rules::CompiledModel& after,
                                          const std::stop_token& stop);

}  // namespace arbiter::service
