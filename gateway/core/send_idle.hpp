// What is left to do for a gateway that has died: to send what is sent while nobody commands, so
// that no robot goes on driving by the last command. For a service manager's ExecStopPost=.
//
// Needs no daemon: nothing is asked of Arbiter.
#pragma once

#include <vector>

#include "gateway/core/middleware.hpp"
#include "gateway/mapping/mapping.hpp"
#include "shm/activity.hpp"

namespace arbiter::gateway {

// Sends the idle sample of each `out` entry that has one every kAgain, for `time`, at least once:
// whoever subscribes has to be found first. Returns at once where there is none. False: one of them
// could never be sent, which has been said. That nobody was there to hear one is said, too. Throws
// what Middleware::sender() throws.
[[nodiscard]] bool send_idle(const std::vector<Mapping>& mappings, Kind kind,
                             Middleware& middleware, shm::Nanoseconds time);

}  // namespace arbiter::gateway
