// Tells the service manager that the loop goes round, where the manager wants to know
// (WatchdogSec=): one that hears nothing for that long kills the daemon and starts another, which
// takes over.
#pragma once

#include "shm/activity.hpp"

namespace arbiter::service {

class Watchdog {
 public:
  // Reads what the service manager asks for: $WATCHDOG_USEC, $WATCHDOG_PID.
  Watchdog();

  // Called once in each round of the loop; sends at half of the interval.
  void go_round(shm::Nanoseconds now);
  // When the loop must go round at the latest, kForever where nobody asks.
  [[nodiscard]] shm::Nanoseconds deadline() const { return next_; }

 private:
  shm::Nanoseconds interval_ = 0;  // 0: nobody asks
  shm::Nanoseconds next_ = shm::kForever;
};

}  // namespace arbiter::service
