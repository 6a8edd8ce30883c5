// A component's process, as the kernel shows it.
#pragma once

namespace arbiter::watch {

// Whether it lives and does not run: it was sent SIGSTOP, or is being debugged. Reads /proc.
[[nodiscard]] bool is_stopped(int pid);

}  // namespace arbiter::watch
