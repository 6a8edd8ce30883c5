// What would keep components apart without a word, though each has a daemon: a clock of its own,
// and a second daemon of the same instance.
#pragma once

#include <string>

#include "shm/activity.hpp"
#include "wire/messages.hpp"

namespace arbiter::wire {

// Why this process cannot work with the daemon that welcomes it, which it asked at that time: its
// CLOCK_MONOTONIC is another. Activity that it begins would be over already, or last for days.
// Empty: the clocks are the same.
[[nodiscard]] std::string find_fault_in_clock(const Message& welcome, shm::Nanoseconds asked);

// That clients whose environment is another may meet at `path`; `met`: where this one has met its
// daemon.
[[nodiscard]] std::string describe_second_daemon(const std::string& instance,
                                                 const std::string& met, const std::string& path);

}  // namespace arbiter::wire
