// What strangers on the network may have a link say: within a quota for all of it, or hosts that
// come and go would fill a disk.
//
// Thread safety: any thread.
#pragma once

#include <string>

#include "gateway/core/say.hpp"

namespace arbiter::link {

// False: not now. The next one that is said tells how many were left out.
bool say_sparingly(gateway::Level level, const std::string& text);

}  // namespace arbiter::link
