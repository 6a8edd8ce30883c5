// What strangers on the network may have a link say: within a quota, or hosts that come and go
// would fill a disk. What is only information has one of its own: where many sources come and go,
// what is wrong is said all the same.
//
// Thread safety: any thread.
#pragma once

#include <string>

#include "gateway/core/say.hpp"

namespace arbiter::link {

// False: not now. The next one that is said tells how many were left out.
bool say_sparingly(gateway::Level level, const std::string& text);
// The same for what is said again until it is true: nothing is left out.
[[nodiscard]] bool say_sooner_or_later(gateway::Level level, const std::string& text);

}  // namespace arbiter::link
