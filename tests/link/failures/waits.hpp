// For how long processes had to wait for a processor: what the kernel says of each of their
// threads. A bound upon what they do can be asserted where they hardly had to.
//
// Thread safety: none.
#pragma once

#include <sys/types.h>

#include <map>
#include <vector>

#include "tests/link/failures/time.hpp"

namespace arbiter::failures {

class Waits {
 public:
  static constexpr Nanoseconds kPeriod = 100 * kMs;

  // Where the last look was a period ago or longer: looks. `pids` by host; 0: this program, which
  // passes on the frames.
  template <class PidsOf>
  void look(unsigned hosts, PidsOf pids_of) {
    const Nanoseconds time = now();
    if (time - last_look_ < kPeriod) return;
    last_look_ = time;
    for (unsigned host = 0; host <= hosts; ++host) add(host, time, pids_of(host));
  }

  // All its threads have waited for so long by then, since the beginning.
  void note(unsigned host, Nanoseconds time, Nanoseconds sum) {
    looks_[host].push_back({time, sum});
  }

  // All threads of the host together, from the last look before to the first one after it; more
  // than anything waited that the threads did one after another. What was not looked at is kNever.
  [[nodiscard]] Nanoseconds waited(unsigned host, Nanoseconds from, Nanoseconds to) const;
  static constexpr Nanoseconds kNever = 1'000'000 * kSecond;

 private:
  struct Look {
    Nanoseconds time = 0;
    Nanoseconds sum = 0;
  };
  void add(unsigned host, Nanoseconds time, const std::vector<pid_t>& pids);

  Nanoseconds last_look_ = 0;
  std::map<unsigned, std::vector<Look>> looks_;
  std::map<pid_t, Nanoseconds> threads_;
};

}  // namespace arbiter::failures
