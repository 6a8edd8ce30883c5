// Somebody sets the clock of the day while Cyclone's threads sleep.
#include <dds/ddsrt/sync.h>
#include <dds/ddsrt/time.h>
#include <dlfcn.h>
#include <gtest/gtest.h>
#include <pthread.h>

#include <atomic>
#include <ctime>
#include <thread>

#include "gateway/dds/domain.hpp"
#include "tests/gateway/dds/own_domain.hpp"
#include "tests/support/await.hpp"

namespace {

std::atomic<int> waits_by_the_clock_of_the_day{0};
std::atomic<int> waits{0};

}  // namespace

// Cyclone calls them in place of the C library's.
extern "C" int pthread_cond_timedwait(pthread_cond_t* cond, pthread_mutex_t* mutex,
                                      const timespec* until) {
  ++waits_by_the_clock_of_the_day;
  static const auto real = reinterpret_cast<decltype(&pthread_cond_timedwait)>(
      ::dlsym(RTLD_NEXT, "pthread_cond_timedwait"));
  return real(cond, mutex, until);
}
extern "C" int pthread_cond_clockwait(pthread_cond_t* cond, pthread_mutex_t* mutex, clockid_t clock,
                                      const timespec* until) {
  if (clock == CLOCK_MONOTONIC) ++waits;
  static const auto real = reinterpret_cast<decltype(&pthread_cond_clockwait)>(
      ::dlsym(RTLD_NEXT, "pthread_cond_clockwait"));
  return real(cond, mutex, clock, until);
}

namespace arbiter::gateway::dds {
namespace {

// Else a clock that is set back by an hour would have them sleep for an hour: nothing would be
// repeated, and others would take this host for gone.
TEST(SteadyWaits, CyclonesThreadsDoNotSleepByAClockThatSomebodyMaySet) {
  const test::OwnDomain number;
  hear_cyclone();
  const int before = waits_by_the_clock_of_the_day;
  const Entity domain(dds_create_domain(number.number(), test::kLoopback), "domain");
  const Entity participant(dds_create_participant(number.number(), nullptr, nullptr),
                           "participant");
  waits = 0;
  test::await([] { return waits >= 2 || waits_by_the_clock_of_the_day > 0; });
  EXPECT_EQ(waits_by_the_clock_of_the_day, before);
}

TEST(SteadyWaits, EndWithTheirTimeOrWhenTheyAreWoken) {
  ddsrt_mutex_t mutex;
  ddsrt_cond_t cond;
  ddsrt_mutex_init(&mutex);
  ddsrt_cond_init(&cond);
  ddsrt_mutex_lock(&mutex);
  EXPECT_FALSE(ddsrt_cond_waitfor(&cond, &mutex, DDS_MSECS(1)));
  EXPECT_FALSE(ddsrt_cond_waitfor(&cond, &mutex, -DDS_SECS(1)));
  EXPECT_FALSE(ddsrt_cond_waituntil(&cond, &mutex, dds_time() + DDS_MSECS(1)));
  EXPECT_FALSE(ddsrt_cond_waituntil(&cond, &mutex, 0));
  const auto wake_during = [&](const auto& wait) {
    std::thread waker([&] {
      ddsrt_mutex_lock(&mutex);
      ddsrt_cond_signal(&cond);
      ddsrt_mutex_unlock(&mutex);
    });
    EXPECT_TRUE(wait());
    ddsrt_mutex_unlock(&mutex);
    waker.join();
    ddsrt_mutex_lock(&mutex);
  };
  wake_during([&] { return ddsrt_cond_waitfor(&cond, &mutex, DDS_SECS(1000)); });
  wake_during([&] { return ddsrt_cond_waitfor(&cond, &mutex, DDS_INFINITY); });
  wake_during([&] { return ddsrt_cond_waituntil(&cond, &mutex, DDS_NEVER); });
  ddsrt_mutex_unlock(&mutex);
  ddsrt_cond_destroy(&cond);
  ddsrt_mutex_destroy(&mutex);
}

}  // namespace
}  // namespace arbiter::gateway::dds
