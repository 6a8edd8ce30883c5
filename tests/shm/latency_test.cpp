#include "shm/latency.hpp"

#include <gtest/gtest.h>

#include <cstdint>

namespace arbiter::test {
namespace {

using shm::kLatencyBuckets;
using shm::latency_bound;
using shm::latency_bucket;

TEST(Latency, EachBucketEndsWhereTheNextBegins) {
  for (std::size_t bucket = 0; bucket + 1 < kLatencyBuckets; ++bucket) {
    const shm::Nanoseconds bound = latency_bound(bucket);
    EXPECT_EQ(latency_bucket(bound - 1), bucket);
    EXPECT_EQ(latency_bucket(bound), bucket + 1);
    EXPECT_LT(bound, latency_bound(bucket + 1));
    if (bucket > 0) {
      EXPECT_LE(bound * 4, latency_bound(bucket - 1) * 5);
    }
  }
}

TEST(Latency, AnyTimeHasABucket) {
  EXPECT_EQ(latency_bucket(INT64_MIN), 0u);
  EXPECT_EQ(latency_bucket(-1), 0u);
  EXPECT_EQ(latency_bucket(0), 0u);
  EXPECT_EQ(latency_bucket(INT64_MAX), kLatencyBuckets - 1);
  EXPECT_GT(latency_bound(kLatencyBuckets - 2), 100'000'000'000);
}

}  // namespace
}  // namespace arbiter::test
