// The thread that ticks a StallGuard. It asks the kernel for nothing else, so that it is late only
// where the whole process is.
#pragma once

#include <condition_variable>
#include <mutex>
#include <thread>

#include "gateway/core/freshness.hpp"

namespace arbiter::gateway {

class StallThread {
 public:
  explicit StallThread(StallGuard& guard);
  StallThread(const StallThread&) = delete;
  StallThread& operator=(const StallThread&) = delete;
  ~StallThread();

 private:
  void run();

  StallGuard& guard_;
  std::mutex mutex_;
  std::condition_variable ended_;
  bool ends_ = false;
  std::thread thread_;
};

}  // namespace arbiter::gateway
