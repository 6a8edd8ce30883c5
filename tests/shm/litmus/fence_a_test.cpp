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
// Where others want the processors too, each meeting may take a turn of the scheduler's: fewer
// rounds are tried then.
constexpr int kLeastRounds = 2'000;
constexpr Nanoseconds kEnough = 20'000'000'000;
// Some tens of microseconds.
constexpr int kSpins = 20'000;
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
  alignas(kCacheLine) std::atomic<Nanoseconds> begin{
      0};  // of the next round; kForever: there is none
  std::array<std::array<bool, kRounds>, 2> saw_other;
};

// Both go on from here within a few nanoseconds, whoever comes last. One whose other has lost its
// processor sleeps: who has slept is soon let run again, who has spun is not.
void meet(Race& race, int self, int point) {
  std::atomic<int>& own = race.at[static_cast<std::size_t>(self)].value;
  const std::atomic<int>& other = race.at[static_cast<std::size_t>(1 - self)].value;
  own.store(point, std::memory_order_release);
  own.notify_one();
  int spins = 0;
  for (int seen = 0; (seen = other.load(std::memory_order_acquire)) < point;) {
    if (++spins > kSpins) other.wait(seen, std::memory_order_acquire);
  }
}

// Whoever comes last to a meeting leaves it first. So they agree on a time, a little later, at
// which both begin. False: there are no more rounds.
bool begin_together(Race& race, int self, int round, Nanoseconds enough) {
  if (self == 0) {
    const Nanoseconds now = monotonic_now();
    const bool is_over = round > kRounds || (round > kLeastRounds && now > enough);
    race.begin.store(is_over ? kForever : now + kHeadStart, std::memory_order_relaxed);
  }
  meet(race, self, 2 * round - 1);
  const Nanoseconds begin = race.begin.load(std::memory_order_relaxed);
  if (begin == kForever) return false;
  while (monotonic_now() < begin) {
  }
  return true;
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

// Returns how many rounds there were.
int publish_and_look(Race& race, int self) {
  stay_on_a_processor_of_our_own(self);
  Source& own = race.sources[static_cast<std::size_t>(self)];
  const Source& other = race.sources[static_cast<std::size_t>(1 - self)];
  const Nanoseconds enough = monotonic_now() + kEnough;
  int round = 1;
  for (; begin_together(race, self, round, enough); ++round) {
    own.activity.write(arrival(round, kForever), false, round);  // as publish() stamps
    full_fence();                                                // (a)
    const ActivityWord seen = other.activity.word.load(std::memory_order_acquire);
    race.saw_other[static_cast<std::size_t>(self)][static_cast<std::size_t>(round - 1)] =
        seen == arrival(round, kForever);
    // The other may be a round ahead only once we have looked.
    meet(race, self, 2 * round);
  }
  return round - 1;
}

struct Seen {
  int rounds = 0;
  int both_missed = 0;
};

Seen run_a_race() {
  const auto race = std::make_unique<Race>();
  Seen seen;
  std::thread one([&] { seen.rounds = publish_and_look(*race, 0); });
  std::thread other([&] { publish_and_look(*race, 1); });
  one.join();
  other.join();
  for (std::size_t i = 0; i < static_cast<std::size_t>(seen.rounds); ++i) {
    seen.both_missed += !race->saw_other[0][i] && !race->saw_other[1][i];
  }
  return seen;
}

#ifdef ARBITER_WITHOUT_FENCE

TEST(FenceA, WithoutItThisMachineLetsBothMiss) {
  const Seen seen = run_a_race();
  std::printf("without fence (a) both missed in %d of %d rounds\n", seen.both_missed, seen.rounds);
}

#else

TEST(FenceA, OfTwoThatStampAtOnceAtLeastOneSeesTheOther) {
  const Seen seen = run_a_race();
  EXPECT_EQ(seen.both_missed, 0) << "of " << seen.rounds << " rounds";
  EXPECT_GE(seen.rounds, kLeastRounds);
}

#endif

}  // namespace
}  // namespace arbiter::shm
