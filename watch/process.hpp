// A component's process, as the kernel shows it.
#pragma once

#include <string>

namespace arbiter::watch {

// "gaze-control (pid 4711)": of a component, or a stranger. The name of one that died before it
// came back to this daemon is not known.
[[nodiscard]] std::string process_text(const auto& process) {
  const std::string who = process.node.empty() ? "a component" : process.node;
  return who + " (pid " + std::to_string(process.pid) + ")";
}

// Whether it lives and does not run: it was sent SIGSTOP, or is being debugged. Reads /proc.
[[nodiscard]] bool is_stopped(int pid);

}  // namespace arbiter::watch
