// arbiter why --follow: each change of a port's winner, with its cause, as it comes.
#pragma once

#include <string>
#include <vector>

#include "cli/why_options.hpp"
#include "shm/ids.hpp"
#include "watch/port.hpp"

namespace arbiter::cli {

// Returns the exit code. Throws as watch::Port does.
int follow_winners(const WhyOptions& options);

// What happened to these sources last, up to that time: "/a became active and /b was deactivated".
std::string events_text(const watch::Port& port, const std::vector<shm::SourceId>& sources,
                        const watch::Look& look, shm::Nanoseconds at);

}  // namespace arbiter::cli
