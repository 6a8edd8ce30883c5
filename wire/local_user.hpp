// Who is at the other end of a Unix socket.
#pragma once

#include <sys/types.h>

#include <vector>

namespace arbiter::wire {

struct LocalUser {
  uid_t user = 0;
  std::vector<gid_t> groups;  // the primary one and the supplementary ones
};

// The user and the groups of the process that connected, at that moment, which the kernel keeps
// with the socket. Nothing that a client says enters. Throws std::system_error.
[[nodiscard]] LocalUser user_at(int socket);

}  // namespace arbiter::wire
