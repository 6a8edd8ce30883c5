// The policy in force, and the clients that it is asked about.
#pragma once

#include <optional>
#include <string>
#include <string_view>

#include "service/client.hpp"
#include "service/policy.hpp"

namespace arbiter::service {

// Who is at the other end of a Unix socket: the user and the groups of the process that connected,
// at that moment, which the kernel keeps with the socket. Nothing that a client says enters.
// Throws std::system_error.
Identity peer_identity(int socket);

class Gate {
 public:
  // Without a file the default policy holds.
  explicit Gate(std::optional<std::string> file);

  // Reads the file again, if there is one; put_in_force() makes it count. Logs every finding.
  // Throws std::runtime_error; then nothing has changed.
  void prepare();
  void put_in_force();
  [[nodiscard]] bool has_file() const { return file_.has_value(); }

  // Throws std::runtime_error if the client may not do it. The message says who may not do what,
  // and which line of the policy says so.
  void require(const Client& client, Action action, std::string_view port = {}) const;

 private:
  std::optional<std::string> file_;
  Policy policy_;
  std::optional<Policy> prepared_;
};

}  // namespace arbiter::service
