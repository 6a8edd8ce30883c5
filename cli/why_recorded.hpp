// arbiter simulate --recording --why.
#pragma once

#include <string>

#include "cli/simulate_recording.hpp"

namespace arbiter::cli {

// What changed the winners and kept arrivals out: by the models that were in force, or by another.
// `port`: empty for all. Returns 0.
int explain_recording(const SimulateRecordingOptions& options, const std::string& port);

}  // namespace arbiter::cli
