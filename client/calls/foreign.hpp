// Ports and nodes in a child of the process that made them: what a call answers there.
//
// A child that was forked has a copy of each object, and of nothing that stands behind it: no
// service thread, no memory that is shared, no conversation with the daemon. Its calls do nothing
// but say so, and its copies are never destroyed: that would wait for a thread that is not there,
// and lock what another thread had locked at the fork.
#pragma once

#include <memory>
#include <string>

#include "client/input/input_core.hpp"
#include "client/node/node_core.hpp"
#include "client/output/output_core.hpp"
#include "client/tap/tap_core.hpp"

namespace arbiter::detail {

// Calls that may throw. `whose`: the port's name, or the node's.
[[noreturn, gnu::cold]] void refuse_foreign(const std::string& whose,
                                            const shm::ProcessMark& process);
template <class Core>
void require_own(const Core& core) {
  if (!core.process.is_here()) [[unlikely]]
    refuse_foreign(core.name(), core.process);
}
inline void require_own(const NodeCore& node) {
  if (node.process().is_surely_here()) return;
  refuse_foreign("the node \"" + node.name() + "\"", node.process());
}

// Calls that may not: a line on standard error, once for each port and child. `warned`: the last
// child that was told.
[[gnu::cold]] void warn_once_that_foreign(const std::string& whose, const shm::ProcessMark& process,
                                          pid_t& warned) noexcept;
template <class Core>
[[nodiscard]] bool is_own(const Core& core) noexcept {
  if (core.process.is_here()) [[likely]]
    return true;
  warn_once_that_foreign(core.name(), core.process, core.warned_about);
  return false;
}

// Keeps a copy for as long as the process lives.
void keep_for_ever(std::shared_ptr<const void> core) noexcept;

}  // namespace arbiter::detail
