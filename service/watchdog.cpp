#include "service/watchdog.hpp"

#include <systemd/sd-daemon.h>

#include <cstdint>
#include <limits>

namespace arbiter::service {

Watchdog::Watchdog() {
  std::uint64_t microseconds = 0;
  constexpr auto kMost = std::numeric_limits<shm::Nanoseconds>::max() / 1000 / 2;
  if (sd_watchdog_enabled(0, &microseconds) <= 0 || microseconds == 0) return;
  if (microseconds > static_cast<std::uint64_t>(kMost)) return;
  interval_ = static_cast<shm::Nanoseconds>(microseconds) * 1000 / 2;
  next_ = 0;
}

void Watchdog::go_round(shm::Nanoseconds now) {
  if (interval_ == 0 || now < next_) return;
  sd_notify(0, "WATCHDOG=1");
  next_ = now + interval_;
}

}  // namespace arbiter::service
