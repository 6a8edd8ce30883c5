// Fence (a): of two publishers that stamp their sources at the same time, at least one sees the
// other. On real processors, with nothing around it that could hide what they do.
//
// Built twice: as it is, and with the fence left out (ARBITER_WITHOUT_FENCE). The second says what
// this machine does then, and asserts nothing: a machine may be so kind as to keep the order.
#include <gtest/gtest.h>
#include <sched.h>

#include <array>
#include <cstdio>
#include <memory>
#include <thread>

#include "shm/activity.hpp"
#include "shm/clock.hpp"

namespace arbiter::shm {
namespace {

constexpr int kRounds = 200'000;
constexpr int kSpins = 200;
constexpr Nanoseconds kHeadStart = 1'000;

struct alignas(kCacheLine) Source {
  Activity activity;
};

struct alignas(kCacheLine) Counter {
  std::atomic<int> value{0};
};

struct Race {
  std::array<Source, 2> sources;
  std::array<Counter, 2> at;
  alignas(kCacheLine) std::atomic<Nanoseconds> begin{0};
  std::array<std::array<bool, kRounds>, 2> saw_other;
};

// Both go on from here within a few nanoseconds, whoever comes last.
void meet(Race& race, int self, int point) {
  race.at[static_cast<std::size_t>(self)].value.store(point, std::memory_order_release);
  int spins = 0;
  while (race.at[static_cast<std::size_t>(1 - self)].value.load(std::memory_order_acquire) <
         point) {
    if (++spins % kSpins == 0) std::this_thread::yield();
  }
}

// Whoever comes last to a meeting leaves it first. So they agree on a time, a little later, at
// which both begin.
void begin_together(Race& race, int self, int round) {
  if (self == 0) race.begin.store(monotonic_now() + kHeadStart, std::memory_order_relaxed);
  meet(race, self, 2 * round - 1);
  const Nanoseconds begin = race.begin.load(std::memory_order_relaxed);
  while (monotonic_now() < begin) {
  }
}

// On one processor there is nothing to see.
void stay_on_a_processor_of_our_own(int self) {
  cpu_set_t allowed;
  if (sched_getaffinity(0, sizeof allowed, &allowed) != 0) return;
  for (std::size_t cpu = 0, seen = 0; cpu < CPU_SETSIZE; ++cpu) {
    if (!CPU_ISSET(cpu, &allowed) || static_cast<int>(seen++) != self) continue;
    cpu_set_t own;
    CPU_ZERO(&own);
    CPU_SET(cpu, &own);
    sched_setaffinity(0, sizeof own, &own);
    return;
  }
}

void publish_and_look(Race& race, int self) {
  stay_on_a_processor_of_our_own(self);
  Source& own = race.sources[static_cast<std::size_t>(self)];
  const Source& other = race.sources[static_cast<std::size_t>(1 - self)];
  for (int round = 1; round <= kRounds; ++round) {
    begin_together(race, self, round);
    own.activity.write(kNeverActive, arrival(round, kForever));  // as publish() stamps
    full_fence();                                                // (a)
    const ActivityWord seen = other.activity.word.load(std::memory_order_acquire);
    race.saw_other[static_cast<std::size_t>(self)][static_cast<std::size_t>(round - 1)] =
        seen == arrival(round, kForever);
    // The other may be a round ahead only once we have looked.
    meet(race, self, 2 * round);
  }
}

int rounds_in_which_both_missed() {
  const auto race = std::make_unique<Race>();
  std::thread one([&] { publish_and_look(*race, 0); });
  std::thread other([&] { publish_and_look(*race, 1); });
  one.join();
  other.join();
  int missed = 0;
  for (std::size_t i = 0; i < kRounds; ++i) {
    missed += !race->saw_other[0][i] && !race->saw_other[1][i];
  }
  return missed;
}

#ifdef ARBITER_WITHOUT_FENCE

TEST(FenceA, WithoutItThisMachineLetsBothMiss) {
  std::printf("without fence (a) both missed in %d of %d rounds\n", rounds_in_which_both_missed(),
              kRounds);
}

#else

TEST(FenceA, OfTwoThatStampAtOnceAtLeastOneSeesTheOther) {
  EXPECT_EQ(rounds_in_which_both_missed(), 0);
}

#endif

}  // namespace
}  // namespace arbiter::shm
