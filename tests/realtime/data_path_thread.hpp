// A component's real-time thread, of which nothing goes unseen: every system call, page fault and
// allocation of what it is given to do.
//
// A seccomp filter of this one thread sends each of its system calls to a watcher, which writes the
// call down and lets it pass. So calls that the C library would make for us are seen too: a clock
// that the vDSO cannot read, a lock that is contended.
//
// As any real-time program would, it has its stack, the program's code and the heap in memory
// before it begins; what is left to fault is what the library has mapped.
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <ostream>
#include <vector>

namespace arbiter::test {

// What a piece of work has cost beside its instructions.
struct Costs {
  std::vector<int> system_calls;  // numbers, in order
  long page_faults = 0;
  std::uint64_t allocations = 0;

  friend bool operator==(const Costs&, const Costs&) = default;
  friend std::ostream& operator<<(std::ostream& out, const Costs& costs);
};

inline const Costs kNone;

class DataPathThread {
 public:
  // Throws std::runtime_error where the kernel offers no seccomp notifications.
  DataPathThread();
  ~DataPathThread();
  DataPathThread(const DataPathThread&) = delete;
  DataPathThread& operator=(const DataPathThread&) = delete;

  // Does the work on the thread; returns when it is done.
  void run(std::function<void()> work);
  // The same, and tells what it cost.
  Costs costs_of(std::function<void()> work);
  // The two halves of costs_of(), for work that waits for something.
  void begin(std::function<void()> work);
  Costs end();
  [[nodiscard]] int task() const;  // as /proc numbers it

 private:
  class State;
  std::unique_ptr<State> state_;
};

}  // namespace arbiter::test
