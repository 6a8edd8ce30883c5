// What `arbiter why` says of the many connections of a port for which a screen has no room.
#pragma once

#include <ostream>
#include <vector>

#include "rules/explain/explain.hpp"

namespace arbiter::cli {

// A line for each reason that keeps several of them out, the one of most first, and one for those
// that are inactive; a few lines, however many they are. None of them wins.
void write_summary(std::ostream& out,
                   const std::vector<const rules::ConnectionExplanation*>& connections);

}  // namespace arbiter::cli
