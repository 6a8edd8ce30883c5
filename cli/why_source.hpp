// Whoever asks `arbiter why` about a source alone is told at which ports it matters, and what to
// ask.
#pragma once

#include <string>

#include "cli/why_options.hpp"
#include "watch/instance.hpp"
#include "wire/status.hpp"

namespace arbiter::cli {

// Throw watch::WatchError where the port that is asked about is a source by this status, or nearest
// to one. `none` says that there is no such input port.
void require_no_source(const WhyOptions& options, const wire::Status& status,
                       const std::string& none);
void require_no_source(const WhyOptions& options, watch::Instance& instance);

}  // namespace arbiter::cli
