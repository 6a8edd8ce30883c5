// Whether a worker hangs, judged by its signs of life.
#pragma once

#include <utility>

#include "shm/clock.hpp"

namespace arbiter::gateway {

class LifeSigns {
 public:
  // It may be silent for so long.
  LifeSigns(shm::Nanoseconds silence, shm::Nanoseconds now)
      : silence_(silence), beat_(now), looked_(now) {}

  void beat(shm::Nanoseconds now) { beat_ = now; }

  // Looks at `now`; call it often in `silence`. `is_stopped` says whether somebody has stopped it,
  // and is asked only where it matters. Time in which one of the two was stopped does not count:
  // the one resumed last has not run.
  template <class IsStopped>
  [[nodiscard]] bool hangs(shm::Nanoseconds now, const IsStopped& is_stopped) {
    const bool was_stopped = now - std::exchange(looked_, now) > silence_ / 2;
    const bool is_silent = now - beat_ > silence_ / 4;
    if (was_stopped || (is_silent && is_stopped())) beat_ = now;
    return now - beat_ >= silence_;
  }

 private:
  shm::Nanoseconds silence_;
  shm::Nanoseconds beat_;
  shm::Nanoseconds looked_;
};

}  // namespace arbiter::gateway
