#include "gateway/dds/steady_waits.hpp"

#include <dds/ddsrt/sync.h>
#include <dds/ddsrt/time.h>
#include <pthread.h>

#include <algorithm>
#include <cerrno>
#include <ctime>

#include "shm/clock.hpp"

namespace arbiter::gateway::dds {

void wait_by_steady_clock() noexcept {}

}  // namespace arbiter::gateway::dds

// In place of Cyclone's functions of these names.
extern "C" bool ddsrt_cond_waitfor(ddsrt_cond_t* cond, ddsrt_mutex_t* mutex,
                                   dds_duration_t reltime) {
  using namespace arbiter;
  constexpr shm::Nanoseconds kSecond = 1'000'000'000;
  if (reltime >= shm::kMaxTime) {
    ddsrt_cond_wait(cond, mutex);
    return true;
  }
  const shm::Nanoseconds end = shm::monotonic_now() + std::max<shm::Nanoseconds>(reltime, 0);
  const timespec until{end / kSecond, end % kSecond};
  return ::pthread_cond_clockwait(&cond->cond, &mutex->mutex, CLOCK_MONOTONIC, &until) != ETIMEDOUT;
}

extern "C" bool ddsrt_cond_waituntil(ddsrt_cond_t* cond, ddsrt_mutex_t* mutex, dds_time_t abstime) {
  return ddsrt_cond_waitfor(cond, mutex,
                            abstime == DDS_NEVER ? DDS_INFINITY : abstime - dds_time());
}
