// Whether a daemon has come to rest: it does nothing more until somebody asks.
#pragma once

#include <sys/syscall.h>
#include <unistd.h>

#include <cstdint>
#include <filesystem>
#include <fstream>
#include <string>
#include <vector>

#include "tests/support/await.hpp"
#include "tests/support/threads.hpp"

namespace arbiter::test {

inline std::vector<pid_t> tasks_of(pid_t process) {
  std::vector<pid_t> tasks;
  for (const auto& entry :
       std::filesystem::directory_iterator("/proc/" + std::to_string(process) + "/task")) {
    tasks.push_back(std::stoi(entry.path().filename()));
  }
  return tasks;
}

// Whether its loop sleeps with no time set for waking; that it sleeps, where no more is told.
inline bool rests(pid_t process) {
  std::ifstream file("/proc/" + std::to_string(process) + "/syscall");
  std::string call, epoll, events, count, timeout;
  file >> call;
  if (call.empty()) return state_of(process, process) == 'S';
  file >> epoll >> events >> count >> timeout;  // nothing, where it is "running"
  return call == std::to_string(SYS_epoll_wait) && timeout.size() >= 8 &&
         timeout.substr(timeout.size() - 8) == "ffffffff";
}

inline void wait_until_it_rests(pid_t process) {
  await([&] { return rests(process); });
}

// Whether each thread but the loop's, which closes what was a client's, or waits for work, waits.
inline bool others_wait(pid_t process) {
  for (const pid_t task : tasks_of(process)) {
    if (task == process) continue;
    const long call = call_of(process, task);
    if (call >= 0 ? call != SYS_futex : call == -1) return false;
  }
  return true;
}

// Until its loop and all other threads rest: one that has finished may have woken another.
inline void wait_until_all_rest(pid_t process) {
  std::uint64_t before = 0;
  do {
    wait_until_it_rests(process);
    before = sleeps_of(process, process);
  } while (!others_wait(process) || !rests(process) || sleeps_of(process, process) != before);
}

}  // namespace arbiter::test
