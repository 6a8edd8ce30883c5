// Where and how a worker runs.
#pragma once

#include <sys/types.h>
#include <time.h>

#include <cstdint>
#include <vector>

namespace arbiter::bench {

// CLOCK_MONOTONIC in nanoseconds.
inline std::int64_t now_ns() {
  timespec time{};
  clock_gettime(CLOCK_MONOTONIC, &time);
  return std::int64_t{time.tv_sec} * 1'000'000'000 + time.tv_nsec;
}

// Keeps the compiler from leaving out what made `value`.
template <class T>
void keep(const T& value) {
  asm volatile("" : : "r,m"(value) : "memory");
}

// What a process has used since it was started, all its threads together. Throws
// std::system_error where there is none.
std::int64_t processor_time_ns(pid_t pid);

// The processors that the benchmark may use, as it was started.
std::vector<int> processors();

// Pins the calling thread to the n-th of them, or, where there are fewer, to one of them. Called
// once all is set up, so that the helper threads of whatever is measured stay free to run
// elsewhere.
void pin(int n);

// Whether this process may run threads with SCHED_FIFO; and makes the calling thread one.
bool may_use_fifo();
void use_fifo(int priority);

}  // namespace arbiter::bench
