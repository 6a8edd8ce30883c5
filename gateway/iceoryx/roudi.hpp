// Whether RouDi, iceoryx's daemon, runs: found out without iceoryx, which ends the process that
// asks.
#pragma once

#include <sys/types.h>

#include <compare>
#include <optional>
#include <string>

namespace arbiter::gateway {

// One run of RouDi. Each makes its socket anew.
struct RoudiIdentity {
  dev_t device = 0;
  ino_t inode = 0;
  std::int64_t changed_ns = 0;  // an inode may be another file's by now

  friend bool operator==(const RoudiIdentity&, const RoudiIdentity&) = default;
};

// The socket that runtimes find it by.
[[nodiscard]] std::string roudi_socket_path();

// Nothing: none runs. A stopped one does. Sends it nothing.
[[nodiscard]] std::optional<RoudiIdentity> find_roudi(const std::string& socket_path);

// False: so much waits for it in its socket that nobody can tell it anything now. If that lasts, it
// hangs, perhaps for a lock that a program which has died has left behind, and still says once a
// second how things stood.
[[nodiscard]] bool can_be_told(const std::string& socket_path);

// Users and groups may be in the way: of this user to RouDi's socket, or of RouDi's to those that
// iceoryx makes for this process, which are of its user and group.
[[nodiscard]] bool is_closed_to_us(const std::string& socket_path);
[[nodiscard]] bool are_ours_closed_to(const std::string& socket_path);

// Whether somebody has stopped it (SIGSTOP); false where that cannot be known.
[[nodiscard]] bool is_roudi_stopped();

}  // namespace arbiter::gateway
