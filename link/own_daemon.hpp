// Questions of a link to the daemon of its own host. Each waits for its answer for a second at
// most.
//
// Thread safety: any thread; each call is a conversation of its own.
#pragma once

#include <string>
#include <utility>

#include "wire/local_user.hpp"

namespace arbiter::link {

using wire::LocalUser;

class OwnDaemon {
 public:
  // `instance`: as NodeOptions has it.
  explicit OwnDaemon(std::string instance) : instance_(std::move(instance)) {}

  // Its documents. Throw wire::CallError, wire::DocumentError.
  [[nodiscard]] std::string status() const;
  [[nodiscard]] std::string model() const;

  // Whether its policy allows that; the reason is thrown (wire::RefusedError). While no daemon
  // answers, root and this process's own user may do everything, and others nothing.
  void require(const LocalUser& who, const std::string& action) const;

 private:
  std::string instance_;
};

}  // namespace arbiter::link
