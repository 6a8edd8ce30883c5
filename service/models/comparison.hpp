// What decides differently under another model, as far as a daemon can tell without keeping those
// who wait for it.
#pragma once

#include <cstdint>
#include <stop_token>

#include <nlohmann/json_fwd.hpp>

#include "rules/prove/compile.hpp"

namespace arbiter::service {

// Steps of a budget: a few tenths of a second, for which a change of the model waits.
inline constexpr std::uint64_t kStepsOfChange = 3'000'000;
// What has been asked for may take longer.
inline constexpr std::uint64_t kStepsOfDryRun = 30'000'000;

// {"summary", "text", "diff"}: one line of it, for the log and the history; all of it, as `arbiter
// diff` and `arbiter diff --json` show it. Throws rules::Stopped.
[[nodiscard]] nlohmann::json changes_json(const rules::CompiledModel& before,
                                          const rules::CompiledModel& after, std::uint64_t steps,
                                          const std::stop_token& stop);

}  // namespace arbiter::service
