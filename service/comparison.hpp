// What decides differently under another model, as far as a daemon can tell between two messages.
#pragma once

#include <nlohmann/json_fwd.hpp>

#include "rules/compile.hpp"

namespace arbiter::service {

// {"summary", "text", "diff"}: one line of it, for the log and the history; all of it, as `arbiter
// diff` and `arbiter diff --json` show it.
[[nodiscard]] nlohmann::json changes_json(const rules::CompiledModel& before,
                                          const rules::CompiledModel& after);

}  // namespace arbiter::service
