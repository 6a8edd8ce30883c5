#include "gateway/core/stall_thread.hpp"

#include <pthread.h>
#include <time.h>

#include <chrono>

#include "shm/clock.hpp"

namespace arbiter::gateway {
namespace {

shm::Nanoseconds suspended() {
  timespec with{};
  ::clock_gettime(CLOCK_BOOTTIME, &with);
  return shm::Nanoseconds{with.tv_sec} * 1'000'000'000 + with.tv_nsec - shm::monotonic_now();
}

}  // namespace

StallThread::StallThread(StallGuard& guard) : guard_(guard), thread_([this] { run(); }) {
  pthread_setname_np(thread_.native_handle(), "stall-guard");
}

StallThread::~StallThread() {
  {
    const std::lock_guard lock(mutex_);
    ends_ = true;
  }
  ended_.notify_one();
  thread_.join();
}

void StallThread::run() {
  std::unique_lock lock(mutex_);
  while (!ends_) {
    const std::chrono::nanoseconds period(guard_.tick(shm::monotonic_now(), suspended()));
    ended_.wait_for(lock, period, [this] { return ends_; });
  }
}

}  // namespace arbiter::gateway
