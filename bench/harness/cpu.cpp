#include "bench/harness/cpu.hpp"

#include <sched.h>

#include <cerrno>
#include <string>
#include <system_error>

namespace arbiter::bench {
namespace {

int try_fifo(int priority) {
  sched_param parameters{};
  parameters.sched_priority = priority;
  return ::sched_setscheduler(0, priority == 0 ? SCHED_OTHER : SCHED_FIFO, &parameters);
}

}  // namespace

std::int64_t processor_time_ns(pid_t pid) {
  clockid_t clock{};
  timespec time{};
  const int error = ::clock_getcpuclockid(pid, &clock);
  if (error != 0 || ::clock_gettime(clock, &time) != 0) {
    throw std::system_error(error != 0 ? error : errno, std::generic_category(),
                            "the processor time of process " + std::to_string(pid));
  }
  return std::int64_t{time.tv_sec} * 1'000'000'000 + time.tv_nsec;
}

std::vector<int> processors() {
  static const std::vector<int> allowed = [] {
    cpu_set_t set;
    CPU_ZERO(&set);
    std::vector<int> found;
    if (::sched_getaffinity(0, sizeof set, &set) != 0) return found;
    for (int cpu = 0; cpu < CPU_SETSIZE; ++cpu) {
      if (CPU_ISSET(cpu, &set)) found.push_back(cpu);
    }
    return found;
  }();
  return allowed;
}

void pin(int n) {
  const std::vector<int> all = processors();
  if (all.empty()) return;
  cpu_set_t set;
  CPU_ZERO(&set);
  CPU_SET(all[static_cast<std::size_t>(n) % all.size()], &set);
  if (::sched_setaffinity(0, sizeof set, &set) != 0) {
    throw std::system_error(errno, std::generic_category(), "sched_setaffinity");
  }
}

bool may_use_fifo() {
  if (try_fifo(1) != 0) return false;
  try_fifo(0);
  return true;
}

void use_fifo(int priority) {
  if (try_fifo(priority) != 0) {
    throw std::system_error(errno, std::generic_category(), "SCHED_FIFO");
  }
}

}  // namespace arbiter::bench
