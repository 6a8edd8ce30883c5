// Rule 8 of docs/hosts.md: one host's part in a switch of all. What it promises, to whom, and for
// how long: 2 s, and 2 s of 10 s to who never commits.
#include "link/core/promise.hpp"

#include <gtest/gtest.h>

namespace arbiter::link {
namespace {

using Verdict = Promise::Verdict;

constexpr shm::Nanoseconds kSecond = 1'000'000'000;
constexpr SwitchAttempt kOne{7, 100}, kOther{8, 100};

static_assert(Promise::kHolds == 2 * kSecond && Promise::kWithin == 10 * kSecond, "rule 8 says so");

TEST(Promise, IsKeptToWhomItWasMadeAndOnce) {
  Promise promise;
  ASSERT_EQ(promise.judge(kOne, 5), Verdict::kFree);
  promise.promise(kOne, "dance", 5);
  EXPECT_EQ(promise.keep(kOther, 6), std::nullopt);
  EXPECT_EQ(promise.keep({7, 101}, 6), std::nullopt) << "another attempt of the same link";
  EXPECT_EQ(promise.keep({9, 100}, 6), std::nullopt) << "an earlier life of it";
  EXPECT_EQ(promise.keep(kOne, 6), "dance");
  EXPECT_EQ(promise.keep(kOne, 6), std::nullopt) << "it has been kept";
  EXPECT_FALSE(promise.is_promised(6));
}

TEST(Promise, ASecondOneIsRefusedAsBusy) {
  Promise promise;
  promise.promise(kOne, "dance", 0);
  EXPECT_EQ(promise.judge(kOther, 1), Verdict::kBusy);
  EXPECT_EQ(promise.judge({7, 101}, 1), Verdict::kBusy) << "two operators on one host";
  promise.release(kOther, 1);
  EXPECT_EQ(promise.judge(kOther, 1), Verdict::kBusy) << "it was none of theirs";
  promise.release(kOne, 1);
  EXPECT_EQ(promise.judge(kOther, 1), Verdict::kFree);
}

TEST(Promise, EndsAfterTwoSecondsWithoutACommit) {
  Promise promise;
  promise.promise(kOne, "dance", 5);
  EXPECT_TRUE(promise.is_promised(5 + Promise::kHolds - 1));
  EXPECT_EQ(promise.keep(kOne, 5 + Promise::kHolds), std::nullopt) << "too late";
  EXPECT_EQ(promise.judge(kOther, 5 + Promise::kHolds), Verdict::kFree);
  promise.promise(kOther, "rest", 5 + Promise::kHolds);
  EXPECT_EQ(promise.keep(kOne, 6 + Promise::kHolds), std::nullopt);
  EXPECT_EQ(promise.keep(kOther, 6 + Promise::kHolds), "rest");
}

TEST(Promise, ThatHasEndedIsNoneWhoeverAsks) {
  Promise promise;
  promise.promise(kOne, "dance", 5);
  EXPECT_FALSE(promise.is_promised(5 + Promise::kHolds));
}

TEST(Promise, AskedForTwiceItHoldsNoLonger) {
  Promise promise;
  promise.promise(kOne, "dance", 0);
  EXPECT_EQ(promise.judge(kOne, kSecond), Verdict::kFree);
  promise.promise(kOne, "dance", kSecond);
  EXPECT_EQ(promise.judge(kOther, Promise::kHolds), Verdict::kFree);
}

// A host that prepares as often as it can, with a new number each time, and never commits.
TEST(Promise, WhoNeverCommitsHoldsForTwoSecondsOfTen) {
  Promise promise;
  shm::Nanoseconds held = 0;
  constexpr shm::Nanoseconds kStep = kSecond / 100;
  std::uint64_t number = 0;
  for (shm::Nanoseconds now = 0; now < 100 * kSecond; now += kStep) {
    const SwitchAttempt next{7, ++number};
    if (promise.judge(next, now) == Verdict::kFree) promise.promise(next, "dance", now);
    if (promise.is_promised(now)) held += kStep;
  }
  // The first two seconds are free, and a fifth of all that follows.
  EXPECT_LE(held, 2 * kSecond + 100 * kSecond / 5 + 2 * kSecond);
  EXPECT_GE(held, 10 * kSecond);
}

TEST(Promise, NorDoesItHelpToReleaseInBetween) {
  Promise promise;
  shm::Nanoseconds held = 0, now = 0;
  for (std::uint64_t number = 1; now < 100 * kSecond; ++number) {
    const SwitchAttempt next{7, number};
    now += kSecond / 1000;
    if (promise.judge(next, now) != Verdict::kFree) continue;
    promise.promise(next, "dance", now);
    now += kSecond / 2;
    held += kSecond / 2;
    promise.release(next, now);
  }
  EXPECT_LE(held, 2 * kSecond + 100 * kSecond / 5 + kSecond);
}

TEST(Promise, OthersAreHeardMeanwhile) {
  Promise promise;
  promise.promise(kOne, "dance", 0);
  const shm::Nanoseconds now = Promise::kHolds;
  EXPECT_EQ(promise.judge({7, 101}, now), Verdict::kTooMuch);
  EXPECT_EQ(promise.judge(kOther, now), Verdict::kFree);
  EXPECT_EQ(promise.judge({7, 101}, now + Promise::kWithin), Verdict::kFree) << "it is forgotten";
}

TEST(Promise, WhoCommitsMaySwitchAsOftenAsItLikes) {
  Promise promise;
  shm::Nanoseconds now = 0;
  for (std::uint64_t number = 1; number < 100; ++number) {
    ASSERT_EQ(promise.judge({7, number}, now), Verdict::kFree);
    promise.promise({7, number}, "dance", now);
    now += kSecond;
    ASSERT_EQ(promise.keep({7, number}, now), "dance");
  }
}

// A new life for each question: what is remembered of them stays bounded, and it goes on.
TEST(Promise, ManyAskersTakeUpABoundedPlace) {
  Promise promise;
  for (std::uint64_t asker = 1; asker < 1000; ++asker) {
    const auto now = static_cast<shm::Nanoseconds>(asker) * Promise::kHolds;
    ASSERT_EQ(promise.judge({asker, 1}, now), Verdict::kFree);
    promise.promise({asker, 1}, "dance", now);
  }
}

}  // namespace
}  // namespace arbiter::link
