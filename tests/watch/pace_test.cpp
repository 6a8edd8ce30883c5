// How often sources arrive, as their words tell, and which of them are slower than their T.
#include "watch/pace.hpp"

#include <gtest/gtest.h>

#include <vector>

namespace arbiter::test {
namespace {

using watch::Pace;

constexpr shm::Nanoseconds kMs = 1'000'000;
constexpr shm::Nanoseconds kTimeout = 100 * kMs;

// Looks every 10 ms, until the last of these arrivals and a moment more.
Pace looked_at(const std::vector<shm::Nanoseconds>& arrivals, shm::Nanoseconds timeout = kTimeout) {
  Pace pace;
  shm::ActivityWord word = shm::kNeverActive;
  std::size_t next = 0;
  for (shm::Nanoseconds now = 0; now <= arrivals.back() + 10 * kMs; now += watch::kPaceLook) {
    for (; next < arrivals.size() && arrivals[next] <= now; ++next) {
      word = shm::arrival(arrivals[next], timeout);
    }
    pace.look(word, timeout, now);
  }
  return pace;
}

TEST(Pace, OfAPublisherThatIsSlowerThanTIsItsPeriod) {
  const Pace pace = looked_at({5 * kMs, 255 * kMs, 506 * kMs});
  EXPECT_EQ(pace.slow_period(), 250 * kMs + kMs / 2);
  EXPECT_TRUE(pace.is_known());
  EXPECT_EQ(watch::slow_text("/a", *pace.slow_period(), kTimeout),
            "/a publishes every 250 ms, and its T is 100 ms: it is inactive in between");
}

TEST(Pace, IsNotToldOfAPublisherInTime) {
  const Pace pace = looked_at({5 * kMs, 95 * kMs, 185 * kMs});
  EXPECT_EQ(pace.slow_period(), std::nullopt);
  EXPECT_TRUE(pace.is_known());
}

// One late arrival, as after a pause, is no period; nor are presses of a button.
TEST(Pace, IsNotToldOfASourceThatKeepsNone) {
  EXPECT_EQ(looked_at({5 * kMs, 255 * kMs, 300 * kMs}).slow_period(), std::nullopt);
  EXPECT_EQ(looked_at({5 * kMs, 50 * kMs, 300 * kMs}).slow_period(), std::nullopt);
  EXPECT_EQ(looked_at({5 * kMs, 255 * kMs, 900 * kMs}).slow_period(), std::nullopt);
  EXPECT_FALSE(looked_at({5 * kMs, 255 * kMs}).is_known());
  EXPECT_EQ(looked_at({5 * kMs}).slow_period(), std::nullopt);
}

// Looks are too rare to see each arrival there; and what never ends is never late.
TEST(Pace, IsNotToldOfAVeryShortTOrOfOneWithoutEnd) {
  EXPECT_EQ(looked_at({0, 50 * kMs, 100 * kMs}, kMs).slow_period(), std::nullopt);
  EXPECT_EQ(looked_at({5 * kMs, 255 * kMs, 505 * kMs}, shm::kForever).slow_period(), std::nullopt);
}

TEST(Pace, BeginsAgainBehindADeactivationAndWithAnotherT) {
  Pace pace = looked_at({5 * kMs, 255 * kMs, 505 * kMs});
  pace.look(shm::deactivation(600 * kMs), kTimeout, 610 * kMs);
  EXPECT_EQ(pace.slow_period(), std::nullopt);
  pace.look(shm::arrival(755 * kMs, kTimeout), kTimeout, 760 * kMs);
  EXPECT_EQ(pace.slow_period(), std::nullopt);
  pace = looked_at({5 * kMs, 255 * kMs, 505 * kMs});
  pace.look(shm::arrival(505 * kMs, kTimeout), 2 * kTimeout, 610 * kMs);
  EXPECT_EQ(pace.slow_period(), std::nullopt);
}

}  // namespace
}  // namespace arbiter::test
