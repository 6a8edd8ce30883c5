#include "gateway/core/stall_thread.hpp"

#include <poll.h>
#include <pthread.h>
#include <time.h>

#include <cstdint>

#include "shm/clock.hpp"

namespace arbiter::gateway {
namespace {

shm::Nanoseconds suspended() {
  timespec with{};
  ::clock_gettime(CLOCK_BOOTTIME, &with);
  return shm::Nanoseconds{with.tv_sec} * 1'000'000'000 + with.tv_nsec - shm::monotonic_now();
}

}  // namespace

StallThread::StallThread(StallGuard& guard, const Bell& bell)
    : guard_(guard), bell_(bell), thread_([this] { run(); }) {
  pthread_setname_np(thread_.native_handle(), "stall-guard");
}

StallThread::~StallThread() {
  end_.ring();
  thread_.join();
}

// One system call for each tick: it ticks several times a second, also where nothing comes.
void StallThread::run() {
  for (;;) {
    const std::uint64_t stops = guard_.stops();
    const shm::Nanoseconds period = guard_.tick(shm::monotonic_now(), suspended());
    if (guard_.stops() != stops) bell_.ring();
    const timespec time{period / 1'000'000'000, period % 1'000'000'000};
    pollfd end{end_.descriptor(), POLLIN, 0};
    if (::ppoll(&end, 1, &time, nullptr) > 0) return;
  }
}

}  // namespace arbiter::gateway
