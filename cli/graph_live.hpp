// arbiter graph of the running system.
#pragma once

#include "cli/graph_picture.hpp"

namespace arbiter::cli {

// Both give the exit code, and throw Error where there is no daemon.
int draw_live(const GraphOptions& options);
// Writes the picture again on each change, until it is interrupted.
int draw_and_follow(const GraphOptions& options);

}  // namespace arbiter::cli
