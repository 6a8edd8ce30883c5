// A process, told from later ones with the same pid by when it began.
#pragma once

#include <sys/types.h>

#include <cstdint>

#include "shm/file_descriptor.hpp"

namespace arbiter::service {

struct Process {
  pid_t pid = 0;
  std::uint64_t started = 0;

  [[nodiscard]] bool lives() const;
  // Not the contrary: false, too, where that cannot be told, as for want of a descriptor.
  [[nodiscard]] bool has_surely_ended() const;
  friend bool operator==(const Process&, const Process&) = default;
};
// When a process began, in clock ticks since boot; 0 where that cannot be told.
std::uint64_t start_of_process(pid_t pid);

// Whether the process of a pidfd has ended.
[[nodiscard]] bool has_ended(const shm::FileDescriptor& process);

// Whether a process is past its last instruction: no thread of it has memory any longer. It closes
// its sockets before its pidfd tells of its end. False where that cannot be told, too.
[[nodiscard]] bool is_ending(pid_t pid);

}  // namespace arbiter::service
