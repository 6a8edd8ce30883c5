// The thread that sends tokens. It waits for nobody else, so it is late only if the whole process
// is.
#pragma once

#include <condition_variable>
#include <functional>
#include <mutex>
#include <thread>

#include "shm/activity.hpp"

namespace arbiter::link {

class TokenClock {
 public:
  // `tick` is called on the thread.
  explicit TokenClock(std::function<void()> tick);
  TokenClock(const TokenClock&) = delete;
  TokenClock& operator=(const TokenClock&) = delete;
  ~TokenClock();

  // 0: not at all, as at the beginning. Any thread.
  void set_period(shm::Nanoseconds period);

 private:
  void run();

  const std::function<void()> tick_;
  std::mutex mutex_;
  std::condition_variable changed_;
  shm::Nanoseconds period_ = 0;
  bool ends_ = false;
  std::thread thread_;
};

}  // namespace arbiter::link
