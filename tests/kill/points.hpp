// Where a process may be told to kill itself: before each atomic operation and each system call
// that the library makes, one after the other.
#pragma once

#include <cstdint>

namespace arbiter::kill {

// From now on points count, of this thread or of all threads, and the one of that number, from 0,
// is fatal.
void arm_this_thread(std::uint64_t fatal) noexcept;
void arm_all_threads(std::uint64_t fatal) noexcept;
// How many points have been passed since.
std::uint64_t disarm() noexcept;

void pass_point() noexcept;

}  // namespace arbiter::kill
