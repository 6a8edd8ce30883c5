// What taps tell, whatever times publishers claim.
#include "top/arrivals.hpp"

#include <gtest/gtest.h>

#include "shm/limits.hpp"
#include "tests/top/pictures.hpp"

namespace arbiter::top {
namespace {

Accepted sample_at(shm::Nanoseconds at) { return {"/p:i", "/low:o", at, true, 1}; }

std::optional<shm::Nanoseconds> oldest_of_one(const Arrivals& arrivals) {
  Census census;
  census.asked = 100 * kSecond;
  census.at = 101 * kSecond;
  PortFact port;
  port.name = "/p:i";
  port.queues = {{"/low:o", 1}};
  return arrivals.oldest_at(port, census);
}

TEST(TopArrivals, AreFreshUntilAPictureHasComeAfterThem) {
  Arrivals arrivals;
  arrivals.add({sample_at(1), sample_at(2), sample_at(3)}, 3);
  arrivals.drop_until(2);
  ASSERT_EQ(arrivals.fresh().size(), 1u);
  EXPECT_EQ(arrivals.fresh().front().at, 3);
}

TEST(TopArrivals, OfATimeThatCannotBeAreLeftOut) {
  Arrivals arrivals;
  arrivals.add({sample_at(INT64_MIN), sample_at(-1), sample_at(90 * kSecond),
                sample_at(99 * kSecond + 1), sample_at(INT64_MAX)},
               99 * kSecond);
  ASSERT_EQ(arrivals.fresh().size(), 1u);
  EXPECT_EQ(arrivals.fresh().front().at, 90 * kSecond);
  EXPECT_EQ(oldest_of_one(arrivals), 11 * kSecond);
}

TEST(TopArrivals, AreBoundedWhereNoPictureComes) {
  Arrivals arrivals;
  const std::vector<Accepted> many(1000, sample_at(1));
  for (std::size_t i = 0; i < Arrivals::kMostNew; i += many.size()) arrivals.add(many, 1);
  arrivals.add({sample_at(2)}, 2);
  EXPECT_EQ(arrivals.fresh().size(), Arrivals::kMostNew);
  EXPECT_EQ(arrivals.fresh().back().at, 2);
}

TEST(TopArrivals, OfOneQueueAscend) {
  Arrivals arrivals;
  arrivals.add({sample_at(97 * kSecond)}, 100 * kSecond);
  arrivals.add({sample_at(95 * kSecond)}, 100 * kSecond);
  EXPECT_EQ(oldest_of_one(arrivals), 4 * kSecond);
  for (std::uint32_t i = 0; i < 3 * shm::kMaxDepth; ++i) {
    arrivals.add({sample_at(98 * kSecond)}, 100 * kSecond);
  }
  EXPECT_EQ(oldest_of_one(arrivals), 3 * kSecond);
}

}  // namespace
}  // namespace arbiter::top
