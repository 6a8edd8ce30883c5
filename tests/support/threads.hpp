// A thread whose sleep can be watched from outside.
#pragma once

#include <pthread.h>
#include <sys/syscall.h>
#include <unistd.h>

#include <atomic>
#include <cstdint>
#include <fstream>
#include <functional>
#include <sstream>
#include <string>
#include <thread>
#include <utility>

namespace arbiter::test {

// The state of a task as /proc tells it: 'S' is asleep.
inline char state_of(pid_t process, pid_t task) {
  std::ifstream file("/proc/" + std::to_string(process) + "/task/" + std::to_string(task) +
                     "/stat");
  std::string line;
  std::getline(file, line);
  const auto end = line.rfind(')');
  return end == std::string::npos ? '?' : line[end + 2];
}

// How often a task has gone to sleep by itself: it grows by one each time that it was woken and
// slept again.
inline std::uint64_t sleeps_of(pid_t process, pid_t task) {
  std::ifstream file("/proc/" + std::to_string(process) + "/task/" + std::to_string(task) +
                     "/status");
  for (std::string line; std::getline(file, line);) {
    std::istringstream words(line);
    std::string key;
    std::uint64_t value = 0;
    words >> key >> value;
    if (key == "voluntary_ctxt_switches:") return value;
  }
  return 0;
}

// What a task sleeps in, as a system call's number; -1: it runs; -2: we are not told.
inline long call_of(pid_t process, pid_t task) {
  std::ifstream file("/proc/" + std::to_string(process) + "/task/" + std::to_string(task) +
                     "/syscall");
  std::string word;
  file >> word;
  if (word.empty()) return -2;
  return word == "running" ? -1 : std::stol(word);
}

inline bool sleeps_in(long call, pid_t process, pid_t task) {
  const long now = call_of(process, task);
  return (now == call || now == -2) && state_of(process, task) == 'S';
}

// Returns once the task sleeps in that system call.
inline void wait_until_it_sleeps_in(long call, pid_t process, pid_t task) {
  while (!sleeps_in(call, process, task)) {
  }
}
inline void wait_until_it_polls(pid_t process, pid_t task) {
  wait_until_it_sleeps_in(SYS_ppoll, process, task);
}

class Watched {
 public:
  explicit Watched(std::function<void()> run)
      : thread_([this, run = std::move(run)] {
          task_ = static_cast<pid_t>(::syscall(SYS_gettid));
          run();
          has_ended_ = true;
        }) {
    while (task_ == 0) {
    }
  }
  ~Watched() {
    if (thread_.joinable()) thread_.join();
  }

  // Returns as well where it has ended, and so will not sleep any more.
  void wait_until_asleep() const {
    while (!has_ended_ && !sleeps_in(SYS_ppoll, ::getpid(), task_)) {
    }
  }
  [[nodiscard]] std::uint64_t sleeps() const { return sleeps_of(::getpid(), task_); }
  void signal(int number) { ::pthread_kill(thread_.native_handle(), number); }
  void join() { thread_.join(); }

 private:
  std::atomic<pid_t> task_{0};
  std::atomic<bool> has_ended_{false};
  std::thread thread_;
};

}  // namespace arbiter::test
