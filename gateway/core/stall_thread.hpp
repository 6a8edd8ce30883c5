// The thread that ticks a StallGuard, and rings where the guard has found that the process had
// stopped. It asks the kernel for nothing else, so that it is late only where the whole process is.
#pragma once

#include <thread>

#include "gateway/core/bridge.hpp"
#include "gateway/core/freshness.hpp"

namespace arbiter::gateway {

class StallThread {
 public:
  // Keeps references.
  StallThread(StallGuard& guard, const Bell& bell);
  StallThread(const StallThread&) = delete;
  StallThread& operator=(const StallThread&) = delete;
  ~StallThread();

 private:
  void run();

  StallGuard& guard_;
  const Bell& bell_;
  const Bell end_;  // rung once
  std::thread thread_;
};

}  // namespace arbiter::gateway
