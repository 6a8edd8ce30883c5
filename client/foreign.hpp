// Ports and nodes in a child of the process that made them: what a call answers there.
//
// A child that was forked has a copy of each object, and of nothing that stands behind it: no
// service thread, no memory that is shared, no conversation with the daemon. Its calls do nothing
// but say so, and its copies are never destroyed: that would wait for a thread that is not there,
// and lock what another thread had locked at the fork.
#pragma once

#include <memory>
#include <string>

#include "client/input_core.hpp"
#include "client/node_core.hpp"
#include "client/output_core.hpp"

namespace arbiter::detail {

// "/Object/pos:o belongs to process 17, and this is process 18, …: make a Node of its own …".
std::string is_foreign(const std::string& whose, const shm::ProcessMark& process);

// Calls that may throw. `core`: a node's or a port's.
template <class Core>
void require_own(const Core& core) {
  if (!core.process.is_here()) throw Error(is_foreign(core.name(), core.process));
}
inline void require_own(const NodeCore& node) {
  if (!node.process().is_surely_here()) {
    throw Error(is_foreign("the node \"" + node.name() + "\"", node.process()));
  }
}

// Calls that may not: a line on standard error, once for each port and child.
void warn_that_foreign(const std::string& whose, const shm::ProcessMark& process) noexcept;
template <class Core>
[[nodiscard]] bool is_own(const Core& core) noexcept {
  if (core.process.is_here()) return true;
  if (std::exchange(core.warned_about, ::getpid()) != ::getpid()) {
    warn_that_foreign(core.name(), core.process);
  }
  return false;
}

// Keeps a copy for as long as the process lives.
void keep_for_ever(std::shared_ptr<const void> core) noexcept;

}  // namespace arbiter::detail
