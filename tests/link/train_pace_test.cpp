// How fast large samples leave: link/core/train_pace.hpp.
#include "link/core/train_pace.hpp"

#include <gtest/gtest.h>

namespace arbiter::link {
namespace {

constexpr std::size_t kPaceTrain = 64 * 1024;
constexpr shm::Nanoseconds kPaceSecond = 1'000'000'000;

// Who always has something to send, and waits as it is told to.
struct Sender {
  TrainPace pace;
  shm::Nanoseconds now = kPaceSecond;
  std::uint64_t repeated = 0;

  // What leaves within a second. `repeats`: whether something has to be repeated all the time.
  double bytes_in_a_second(bool repeats) {
    double bytes = 0;
    for (const shm::Nanoseconds end = now + kPaceSecond; now < end;) {
      if (repeats) ++repeated;
      now += pace.leave(kPaceTrain, repeated, now);
      bytes += kPaceTrain;
    }
    return bytes;
  }
};

TEST(TrainPace, LetsAShortBurstGo) {
  TrainPace pace;
  EXPECT_EQ(pace.leave(1000, 0, kPaceSecond), 0);
  EXPECT_EQ(pace.leave(kPaceTrain, 0, kPaceSecond), 0);
  EXPECT_GT(pace.leave(kPaceTrain, 0, kPaceSecond), 0);
}

TEST(TrainPace, ForgetsWhatHasLeftLongAgo) {
  TrainPace pace;
  for (int i = 0; i < 100; ++i) static_cast<void>(pace.leave(kPaceTrain, 0, kPaceSecond));
  EXPECT_EQ(pace.leave(kPaceTrain, 0, 2 * kPaceSecond), 0);
}

TEST(TrainPace, FallsToTheSlowestWhileThingsAreRepeated) {
  Sender sender;
  sender.bytes_in_a_second(true);
  EXPECT_EQ(sender.pace.pace(), TrainPace::kSlowest);
  EXPECT_LE(sender.bytes_in_a_second(true), TrainPace::kSlowest + TrainPace::kBurst + kPaceTrain);
}

TEST(TrainPace, RisesWhileNothingIsRepeated) {
  Sender sender;
  sender.bytes_in_a_second(true);
  EXPECT_GT(sender.bytes_in_a_second(false), TrainPace::kSlowest + TrainPace::kBurst + kPaceTrain);
  for (int i = 0; i < 10; ++i) sender.bytes_in_a_second(false);
  EXPECT_EQ(sender.pace.pace(), TrainPace::kFastest);
}

// What was repeated before it began says nothing.
TEST(TrainPace, BeginsWithWhatHasBeenRepeatedBefore) {
  TrainPace pace(1000);
  static_cast<void>(pace.leave(kPaceTrain, 1000, kPaceSecond));
  EXPECT_GE(pace.pace(), TrainPace::kFirst);
}

// All of a burst that was lost is repeated, which says one thing only.
TEST(TrainPace, IsLoweredOnceForALoss) {
  TrainPace pace;
  static_cast<void>(pace.leave(kPaceTrain, 0, kPaceSecond));
  const double before = pace.pace();
  for (std::uint64_t repeated = 1; repeated < 50; ++repeated) {
    const shm::Nanoseconds now = kPaceSecond + static_cast<shm::Nanoseconds>(repeated) * 100'000;
    static_cast<void>(pace.leave(kPaceTrain, repeated, now));
  }
  EXPECT_NEAR(pace.pace(), before * 0.7, 1);
}

}  // namespace
}  // namespace arbiter::link
