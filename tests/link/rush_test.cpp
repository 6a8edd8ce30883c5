// When a thread that sends stays awake: link/core/rush.hpp.
#include "link/core/rush.hpp"

#include <gtest/gtest.h>

namespace arbiter::link {
namespace {

constexpr shm::Nanoseconds kWork = 300'000;  // that each takes

// As many, each so long after the rest began. Returns when the last rest began.
shm::Nanoseconds come(Rush& rush, unsigned count, shm::Nanoseconds apart,
                      shm::Nanoseconds now = 1'000'000'000) {
  rush.rest(now);
  for (unsigned i = 0; i < count; ++i) {
    rush.come(now += apart);
    rush.rest(now += kWork);
  }
  return now;
}

TEST(ARush, BeginsWithManyOneRightAfterAnother) {
  Rush rush;
  EXPECT_FALSE(rush.lasts(0));
  EXPECT_FALSE(rush.lasts(come(rush, Rush::kMany - 1, Rush::kGap - 1)));
  EXPECT_TRUE(rush.lasts(come(rush, Rush::kMany, Rush::kGap - 1)));
}

TEST(ARush, EndsWhereNothingFollows) {
  Rush rush;
  const shm::Nanoseconds last = come(rush, 100, 1000);
  EXPECT_TRUE(rush.lasts(last + Rush::kGap - 1));
  EXPECT_FALSE(rush.lasts(last + Rush::kGap));
}

TEST(ARush, BeginsAnewAfterAGap) {
  Rush rush;
  const shm::Nanoseconds later = come(rush, 100, 1000) + Rush::kGap;
  rush.come(later);
  EXPECT_FALSE(rush.lasts(come(rush, Rush::kMany - 1, 1000, later)));
  EXPECT_TRUE(rush.lasts(come(rush, Rush::kMany, 1000, later)));
}

TEST(ARush, IsNotWhatComesNowAndThen) {
  Rush rush;
  EXPECT_FALSE(rush.lasts(come(rush, 1000, Rush::kGap)));
}

}  // namespace
}  // namespace arbiter::link
