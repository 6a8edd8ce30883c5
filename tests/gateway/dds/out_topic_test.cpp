// Which samples the thread that receives them may send.
#include "gateway/dds/out_topic.hpp"

#include <gtest/gtest.h>

#include "tests/gateway/mapping_text.hpp"

namespace arbiter::gateway::dds {
namespace {

constexpr std::size_t kMiB = std::size_t{1} << 20;
constexpr shm::Nanoseconds kMillisecond = 1'000'000;

TEST(OutTopic, TakesSamplesOf64KiBAndTheirHeaderAtOnceAndNoLargerOnesAtFirst) {
  const Read read = read_dds("<out port='/Base/cmd:i' topic='/cmd' type='a/msg/B'/>");
  Account account(read.entry().outside(), "subscriber");
  const Bell bell;
  const OutTopic topic(read.entry(), account, bell);
  const Sender& sender = topic;
  EXPECT_EQ(sender.largest_at_once(), 4u + 65'536u);
}

TEST(Pace, WhatIsSentFastMayBeSentAtOnce) {
  Pace pace;
  for (int i = 0; i < 20; ++i) pace.note(kMiB, kMillisecond);
  EXPECT_GT(pace.largest(), kMiB);
  EXPECT_LE(pace.largest(), 2 * kMiB);
}

// The socket's buffer may have taken it.
TEST(Pace, ASampleSaysNothingOfOneThatIsMuchLarger) {
  Pace pace;
  for (int i = 0; i < 100; ++i) pace.note(kMiB / 8, kMillisecond / 1000);
  EXPECT_LE(pace.largest(), kMiB / 4);
}

// 8 MiB at 1 Gbit/s: an emergency stop would wait as long.
TEST(Pace, WhatTakesTooLongIsNot) {
  Pace pace;
  for (int i = 0; i < 100; ++i) pace.note(8 * kMiB, 65 * kMillisecond);
  EXPECT_LT(pace.largest(), kMiB);
  EXPECT_GT(pace.largest(), Pace::kAlways);
}

TEST(Pace, ASlowOneCountsAtOnceAndAFastOneByAndBy) {
  Pace pace;
  for (int i = 0; i < 20; ++i) pace.note(kMiB, kMillisecond);
  pace.note(kMiB, 4 * kMillisecond);
  EXPECT_LE(pace.largest(), kMiB / 2);
  pace.note(kMiB, kMillisecond);
  EXPECT_LT(pace.largest(), kMiB);
  pace.note(kMiB, kMillisecond);
  pace.note(kMiB, kMillisecond);
  EXPECT_GT(pace.largest(), kMiB);
}

TEST(Pace, StaysWithinItsBounds) {
  Pace pace;
  pace.note(kMiB, 1000 * kMillisecond);
  EXPECT_EQ(pace.largest(), Pace::kAlways);
  for (int i = 0; i < 100; ++i) pace.note(1000 * kMiB, 0);
  EXPECT_LE(pace.largest(), 2000 * kMiB);
}

}  // namespace
}  // namespace arbiter::gateway::dds
