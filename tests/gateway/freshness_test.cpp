// Never late: what a gateway that has not run for a while may still pass on. The tests say what
// time it is.
#include "gateway/core/freshness.hpp"

#include <gmock/gmock.h>

#include "gateway/core/max_ages.hpp"

namespace arbiter::gateway {
namespace {

using shm::kForever;
constexpr shm::Nanoseconds kMs = 1'000'000;

TEST(QueueFreshness, NothingIsInTimeBeforeTheQueueWasSeenEmpty) {
  const QueueFreshness freshness(8);
  EXPECT_LT(freshness.deadline(shm::kMaxTime), 1);
}

TEST(QueueFreshness, WhatIsTakenIsNoOlderThanTheQueueWasSeenEmpty) {
  QueueFreshness freshness(8);
  freshness.note_empty(1000 * kMs);
  EXPECT_EQ(freshness.deadline(500 * kMs), 1500 * kMs);
}

TEST(QueueFreshness, LookedAtEveryQuarterOfTAFreshSampleIsInTime) {
  QueueFreshness freshness(8);
  const shm::Nanoseconds t = 100 * kMs;
  for (shm::Nanoseconds look = 0; look < 10 * t; look += QueueFreshness::period(t)) {
    freshness.note_empty(look);
    const shm::Nanoseconds taken = look + QueueFreshness::period(t) - 1;
    EXPECT_GE(freshness.deadline(t) - taken, 3 * t / 4);
  }
}

// Of a queue of two that always has something in it, ever more of what is taken is known to be new.
TEST(QueueFreshness, AQueueThatIsNeverEmptyHoldsNoMoreThanItsCapacity) {
  QueueFreshness freshness(2);
  freshness.note_empty(0);
  for (shm::Nanoseconds look = 1; look <= 3; ++look) {
    freshness.note_taken(look * kMs);
    EXPECT_EQ(freshness.deadline(100 * kMs), 100 * kMs) << look;
  }
  freshness.note_taken(4 * kMs);  // the third behind the first was put in after that was taken
  EXPECT_EQ(freshness.deadline(100 * kMs), 101 * kMs);
  freshness.note_empty(5 * kMs);
  freshness.note_taken(6 * kMs);
  EXPECT_EQ(freshness.deadline(100 * kMs), 105 * kMs);
}

class Guarded : public testing::Test {
 protected:
  Guarded() {
    age_.set(kT);
    watch_ = &guard_.add(age_);
  }

  // Ticks in time until `until`.
  void run_until(shm::Nanoseconds until) {
    while (ticked_ + period_ <= until) tick(ticked_ + period_);
    now_ = until;
  }
  void tick(shm::Nanoseconds at) {
    now_ = ticked_ = at;
    period_ = guard_.tick(at);
  }
  void start() { tick(now_); }
  // Nothing runs for that long; then it ticks.
  void stall(shm::Nanoseconds time) { tick(ticked_ + time); }
  [[nodiscard]] bool is_late() const { return guard_.deadline(*watch_, now_) < now_; }

  static constexpr shm::Nanoseconds kT = 200 * kMs;
  shm::Nanoseconds now_ = 1'000'000 * kMs;
  shm::Nanoseconds ticked_ = 0;
  shm::Nanoseconds period_ = 0;
  MaxAge age_;
  StallGuard guard_;
  StallGuard::Watch* watch_ = nullptr;
};

// Where it ticks before anything can be received, nothing has waited: a robot need not wait for T,
// which may be long.
TEST_F(Guarded, NothingIsInTimeBeforeTheFirstTickAndEverythingFromItOn) {
  EXPECT_TRUE(is_late());
  start();
  EXPECT_FALSE(is_late());
  run_until(now_ + kT - 1);
  EXPECT_FALSE(is_late());
}

TEST_F(Guarded, WhileItRunsEverythingIsInTimeWithAtLeastHalfOfTLeft) {
  start();
  EXPECT_EQ(period_, kT / 4);
  run_until(now_ + kT);
  for (int i = 0; i < 100; ++i) {
    run_until(now_ + 7 * kMs);
    ASSERT_FALSE(is_late());
    ASSERT_GE(guard_.deadline(*watch_, now_) - now_, kT / 2);
  }
}

TEST_F(Guarded, ACallbackThatRunsBeforeTheTickSeesTheStallItself) {
  start();
  run_until(now_ + 3 * kT);
  now_ = ticked_ + kT + 1;  // stopped; the middleware's thread is the first to run
  EXPECT_TRUE(is_late());
  now_ = ticked_ + kT;  // nothing can have waited for longer than T
  EXPECT_FALSE(is_late());
}

// What has waited is gone after a third of the time that it has waited for.
TEST_F(Guarded, AfterAStallEverythingIsLateUntilAllThatWaitedIsGone) {
  start();
  run_until(now_ + 3 * kT);
  stall(3 * kT);
  const shm::Nanoseconds resumed = now_;
  EXPECT_TRUE(is_late());
  run_until(resumed + kT - 1);
  EXPECT_TRUE(is_late());
  run_until(resumed + kT);
  EXPECT_FALSE(is_late());
}

// However long T is: what a kernel keeps for a socket is soon read.
TEST_F(Guarded, AfterAnyStallALongTIsServedAgainAfterHalfASecond) {
  age_.set(10'000 * kMs);
  start();
  run_until(now_ + 3 * kT);
  stall(3600'000 * kMs);
  const shm::Nanoseconds resumed = now_;
  run_until(resumed + RunRecord::kLongestDrain - 1);
  EXPECT_TRUE(is_late());
  run_until(resumed + RunRecord::kLongestDrain);
  EXPECT_FALSE(is_late());
  EXPECT_GE(guard_.deadline(*watch_, now_) - now_, age_.get() / 2);
}

// After a stall that is shorter than T nothing is late but what has waited and is not delivered.
TEST_F(Guarded, WhatHasWaitedForLessThanTArrivesUntilTIsOver) {
  age_.set(10'000 * kMs);
  start();
  run_until(now_ + 3 * kT);
  stall(6000 * kMs);
  EXPECT_EQ(guard_.deadline(*watch_, now_), now_ + 4000 * kMs);
}

TEST_F(Guarded, AStallBehindAStallExtendsIt) {
  start();
  run_until(now_ + 3 * kT);
  stall(kT);
  stall(kT);  // nothing was read in between
  const shm::Nanoseconds resumed = now_;
  run_until(resumed + 2 * kT / 3 - 1);
  EXPECT_TRUE(is_late());
  run_until(resumed + 2 * kT / 3 + 1);
  EXPECT_FALSE(is_late());
}

TEST_F(Guarded, AStallLongAfterAStallIsOneOfItsOwn) {
  start();
  run_until(now_ + 3 * kT);
  stall(3 * kT);
  run_until(now_ + 3 * kT);
  ASSERT_FALSE(is_late());
  stall(kT);
  run_until(now_ + kT / 3 + 1);
  EXPECT_FALSE(is_late());
}

// A process that is starved, whose every tick is late, never catches up.
TEST_F(Guarded, WhileEveryTickIsLateSoIsEverything) {
  start();
  for (int i = 0; i < 100; ++i) {
    stall(kT + 1);
    ASSERT_TRUE(is_late());
  }
}

// A thread of the middleware that took a sample, and then did not run until after a stall.
TEST_F(Guarded, ACallbackThatWasHeldUpOverAStallIsLate) {
  start();
  run_until(now_ + 3 * kT);
  stall(3 * kT);
  const shm::Nanoseconds then = now_;
  run_until(then + 3 * kT);
  stall(kT / 2 + period_);
  now_ = then;
  EXPECT_LT(guard_.deadline(*watch_, then), then);
}

TEST_F(Guarded, ADelayOfHalfOfTIsForgiven) {
  start();
  run_until(now_ + 3 * kT);
  now_ = ticked_ + period_ + kT / 2;
  EXPECT_FALSE(is_late());
  tick(now_);
  for (const shm::Nanoseconds resumed = now_; now_ < resumed + kT; run_until(now_ + kMs)) {
    ASSERT_FALSE(is_late()) << now_ - resumed;
  }
}

TEST_F(Guarded, AStallIsOneForShortTAndNotForLongT) {
  MaxAge long_age;
  long_age.set(100 * kT);
  const StallGuard::Watch& other = guard_.add(long_age);
  start();
  run_until(now_ + 200 * kT);
  ASSERT_GT(guard_.deadline(other, now_), now_);
  stall(3 * kT);
  EXPECT_TRUE(is_late());
  EXPECT_GT(guard_.deadline(other, now_), now_);
}

TEST_F(Guarded, AShorterTTicksFasterFromTheNextTickOn) {
  start();
  age_.set(40 * kMs);
  tick(now_ + period_);
  EXPECT_EQ(period_, 10 * kMs);
}

TEST(MaxAgeOf, IsTOrLessAndForEverHasABoundOfItsOwn) {
  EXPECT_EQ(max_age_of(200, 500, {}), 200);
  EXPECT_EQ(max_age_of(200, 500, 100), 100);
  EXPECT_EQ(max_age_of(200, 500, 300), 200);
  EXPECT_EQ(max_age_of(kForever, 500, {}), 500);
  EXPECT_EQ(max_age_of(kForever, 500, 900), 900);
  EXPECT_EQ(max_age_of(kForever, kForever, {}), shm::kDefaultTimeout);
}

// What reliable publishers repeat after that may be older than T, and looks fresh.
TEST_F(Guarded, AStopOfLongerThanTIsCounted) {
  start();
  run_until(now_ + 10 * kT);
  EXPECT_EQ(guard_.stops(), 0u);
  stall(5 * kT);
  EXPECT_EQ(guard_.stops(), 1u);
  run_until(now_ + 10 * kT);
  EXPECT_EQ(guard_.stops(), 1u);
}

// A scheduler that is late is no stop, and nothing is lost meanwhile.
TEST_F(Guarded, AShortPauseIsNoStopEvenIfTIsShorter) {
  start();
  stall(StallGuard::kShortestStop);
  EXPECT_TRUE(is_late());
  EXPECT_EQ(guard_.stops(), 0u);
}

TEST_F(Guarded, AStopThatIsShorterThanEachTIsNone) {
  age_.set(100 * kT);
  start();
  stall(99 * kT);
  EXPECT_EQ(guard_.stops(), 0u);
  MaxAge short_age;
  short_age.set(kT);
  guard_.add(short_age);
  stall(99 * kT);
  EXPECT_EQ(guard_.stops(), 1u);
}

// CLOCK_MONOTONIC does not count it.
TEST_F(Guarded, AMachineThatWasSuspendedHasStopped) {
  start();
  tick(ticked_ + period_);
  guard_.tick(ticked_ + 2 * period_, 5 * kT);
  EXPECT_EQ(guard_.stops(), 1u);
  guard_.tick(ticked_ + 3 * period_, 5 * kT);
  EXPECT_EQ(guard_.stops(), 1u);
}

}  // namespace
}  // namespace arbiter::gateway
