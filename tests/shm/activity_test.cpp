#include "shm/activity.hpp"

#include <gtest/gtest.h>

namespace arbiter::shm {
namespace {

constexpr Nanoseconds kT = 500'000'000;

TEST(Activity, ASourceThatNeverPublishedIsInactiveAtEveryTime) {
  for (const Nanoseconds now : {Nanoseconds{0}, Nanoseconds{1}, kMaxTime}) {
    EXPECT_FALSE(is_active(kNeverActive, now));
  }
}

TEST(Activity, AnArrivalMakesActiveForTheHalfOpenIntervalOfT) {
  for (const Nanoseconds at : {Nanoseconds{1}, Nanoseconds{123'456'789}, kMaxTime}) {
    for (const Nanoseconds timeout : {Nanoseconds{1}, kT, kMaxTime}) {
      const ActivityWord word = arrival(at, timeout);
      EXPECT_TRUE(is_active(word, at));
      EXPECT_TRUE(is_active(word, at + timeout - 1));
      EXPECT_FALSE(is_active(word, at + timeout));
      EXPECT_FALSE(is_active(word, at + timeout + 1));
      EXPECT_TRUE(is_finite(word));
    }
  }
}

TEST(Activity, ALaterArrivalRestartsTheInterval) {
  const ActivityWord first = arrival(1000, kT);
  const ActivityWord second = arrival(1000 + kT - 1, kT);
  EXPECT_FALSE(is_active(first, 1000 + kT));
  EXPECT_TRUE(is_active(second, 1000 + kT));
}

TEST(Activity, ForeverIsActiveAtEveryTimeAndNoPassingOfTimeCanEndIt) {
  for (const Nanoseconds at : {Nanoseconds{0}, Nanoseconds{1}, kMaxTime}) {
    const ActivityWord word = arrival(at, kForever);
    EXPECT_TRUE(is_active(word, 0));
    EXPECT_TRUE(is_active(word, 2 * kMaxTime));
    EXPECT_FALSE(is_finite(word));
  }
}

TEST(Activity, TheLongestFiniteActivityIsNotForever) {
  EXPECT_TRUE(is_finite(arrival(kMaxTime, kMaxTime)));
  EXPECT_LT(arrival(kMaxTime, kMaxTime), kForeverFlag);
}

TEST(Activity, ADeactivationMakesInactiveAtEveryTime) {
  for (const Nanoseconds at : {Nanoseconds{0}, Nanoseconds{1}, kMaxTime}) {
    const ActivityWord word = deactivation(at);
    EXPECT_FALSE(is_active(word, 0));
    EXPECT_FALSE(is_active(word, kMaxTime));
    EXPECT_FALSE(is_finite(word));
  }
}

TEST(Activity, ValuesOfDifferentTimesAndKindsDiffer) {
  EXPECT_NE(deactivation(5), deactivation(6));
  EXPECT_NE(arrival(5, kForever), arrival(6, kForever));
  EXPECT_NE(arrival(5, kT), arrival(6, kT));
  EXPECT_NE(deactivation(0), kNeverActive);
  EXPECT_NE(arrival(0, kForever), kNeverActive);
}

TEST(Activity, EachKindOfWordTellsWhetherItWasWrittenAfterAReading) {
  EXPECT_FALSE(is_newer_than(arrival(1000, kT), kT, 1000));
  EXPECT_TRUE(is_newer_than(arrival(1001, kT), kT, 1000));
  EXPECT_FALSE(is_newer_than(arrival(1000, kForever), kForever, 1000));
  EXPECT_TRUE(is_newer_than(arrival(1001, kForever), kForever, 1000));
  EXPECT_FALSE(is_newer_than(deactivation(1000), kT, 1000));
  EXPECT_TRUE(is_newer_than(deactivation(1001), kT, 1000));
  EXPECT_FALSE(is_newer_than(kNeverActive, kT, 1000));
}

TEST(Activity, AFiniteWordOfASourceThatNowHasNoEndLooksOld) {
  EXPECT_FALSE(is_newer_than(arrival(1001, kT), kForever, 1000));
}

}  // namespace
}  // namespace arbiter::shm
