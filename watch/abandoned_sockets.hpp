// Sockets of daemons that have gone without removing them.
#pragma once

#include <string>
#include <vector>

namespace arbiter::watch {

// The paths of those in the directory, in byte order, of at most 64 that are looked at. Connects to
// each and hangs up; waits for nobody.
[[nodiscard]] std::vector<std::string> abandoned_sockets(const std::string& directory);

}  // namespace arbiter::watch
