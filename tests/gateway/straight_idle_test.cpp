// A port that becomes idle while samples go straight on: the loop, which alone says so to its
// readers, hears of it whoever has the turn.
#include <gmock/gmock.h>
#include <unistd.h>

#include <atomic>
#include <fstream>
#include <string>
#include <thread>

#include "shm/clock.hpp"
#include "tests/gateway/straight_scene.hpp"
#include "tests/support/await.hpp"

namespace arbiter::gateway {
namespace {

using testing::ElementsAre;
using testing::IsEmpty;

// Navigation commands while a lock is released.
std::string locked(const std::string& timeout) {
  return "<behaviors timeout='" + timeout +
         "'><behavior name='Navigate'><config at='/Base/cmd:i'>/Nav/cmd:o</config>"
         "<condition>/EStop/released:o</condition></behavior></behaviors>";
}

class StraightWithALock : public Straight {
 protected:
  explicit StraightWithALock(const std::string& timeout = "1000s",
                             const std::string& idle = "idle='zero' size='4'")
      : Straight(locked(timeout), idle) {}

  void lead_navigation() {
    sender_.sent.clear();
    lock_.signal();
    Straight::lead_navigation();
  }

  OutputPort<void> lock_ = node_.output_port("/EStop/released:o", Type::untyped(1));
};

bool sleeps(pid_t thread) {
  std::string line;
  std::getline(std::ifstream("/proc/self/task/" + std::to_string(thread) + "/stat"), line);
  const auto end = line.rfind(") ");
  return end != std::string::npos && line.substr(end + 2, 1) == "S";
}

// A publisher that never rests would leave it none. Here the loop has an idle sample to send, and
// is not done with it before it may be.
TEST_F(StraightWithALock, ALoopThatWaitsForItsTurnHasTheNext) {
  std::atomic<pid_t> waiting = 0;
  std::atomic<bool> may_end = false;
  ASSERT_TRUE(outgoing_.begin_turn(1));
  sender_.meanwhile = [&] { test::await([&] { return may_end.load(); }); };
  std::thread loop([&] {
    waiting = ::gettid();
    outgoing_.run(shm::monotonic_now() + Outgoing::kIdlePeriod);
  });
  test::await([&] { return waiting != 0 && sleeps(waiting); });
  outgoing_.end_turn("/Nav/cmd:o", shm::kForever);
  const bool has_another = outgoing_.begin_turn(1);
  if (has_another) outgoing_.end_turn("/Nav/cmd:o", shm::kForever);
  may_end = true;
  loop.join();
  EXPECT_FALSE(has_another);
  EXPECT_TRUE(outgoing_.begin_turn(1));
  outgoing_.end_turn("/Nav/cmd:o", shm::kForever);
}

// While a thread has the turn the port rings for nobody.
TEST_F(StraightWithALock, APortThatBecomesIdleInATurnIsLeftToTheLoop) {
  lead_navigation();
  sender_.meanwhile = [this] { lock_.deactivate(); };
  deliver(nav_, "drive");
  sender_.meanwhile = {};
  EXPECT_THAT(sender_.sent, ElementsAre("drive"));
  EXPECT_EQ(calls_, 1);
  EXPECT_EQ(outgoing_.next(), 0);
  run();
  EXPECT_THAT(sender_.sent, ElementsAre("drive", kZeros));
  EXPECT_EQ(account_.idle.value(), 2u) << "at the start, and now";
  deliver(nav_, "loses");
  EXPECT_EQ(calls_, 1) << "the loop knows that it is idle";
}

// The base would go on with what it was sent before.
TEST_F(StraightWithALock, ASampleThatIsTooOldInATurnHasTheLoopSayStop) {
  lead_navigation();
  nav_.max_age().set(-1);
  deliver(nav_, "old");
  EXPECT_THAT(sender_.sent, IsEmpty());
  EXPECT_EQ(account_.late.value(), 1u);
  EXPECT_EQ(calls_, 1);
  run();
  EXPECT_THAT(sender_.sent, ElementsAre(kZeros));
}

TEST_F(StraightWithALock, APortThatBecomesIdleInATurnWithoutASampleIsLeftToTheLoop) {
  lead_navigation();
  ASSERT_TRUE(outgoing_.begin_turn(1));
  lock_.deactivate();
  EXPECT_FALSE(outgoing_.end_turn("/Nav/cmd:o", shm::kForever));
  EXPECT_EQ(calls_, 1);
  run();
  EXPECT_THAT(sender_.sent, ElementsAre(kZeros));
}

TEST_F(StraightWithALock, APortThatBecomesIdleAfterATurnRings) {
  lead_navigation();
  deliver(nav_, "drive");
  EXPECT_FALSE(calls_loop());
  lock_.deactivate();
  EXPECT_TRUE(calls_loop());
  EXPECT_EQ(calls_, 0);
  run();
  EXPECT_THAT(sender_.sent, ElementsAre("drive", kZeros));
}

// Released again before the loop has come: there is nothing to be sent.
TEST_F(StraightWithALock, APortThatIsCommandedAgainBeforeTheLoopComesIsNotStopped) {
  lead_navigation();
  ASSERT_TRUE(outgoing_.begin_turn(1));
  lock_.deactivate();
  outgoing_.end_turn("/Nav/cmd:o", shm::kForever);
  lock_.signal();
  run();
  EXPECT_THAT(sender_.sent, IsEmpty());
  EXPECT_EQ(outgoing_.next(), shm::kForever);
}

// The loop says stop, at once, and again as to an idle port.
TEST_F(StraightWithALock, AWinnerWhoseSamplesCannotBeSentInATurnIsLeftToTheLoopOnce) {
  lead_navigation();
  sender_.answers = {Sender::Result::kNoMemory};
  deliver(nav_, "lost");
  EXPECT_EQ(calls_, 1);
  EXPECT_EQ(outgoing_.next(), 0);
  run();
  EXPECT_THAT(sender_.sent, ElementsAre(kZeros));
  const shm::Nanoseconds next = outgoing_.next();
  EXPECT_GT(next, 0);
  sender_.answers = {Sender::Result::kNoMemory};
  deliver(nav_, "lost");
  EXPECT_EQ(calls_, 1) << "the loop knows";
  EXPECT_EQ(outgoing_.next(), next);
  outgoing_.run(next);
  EXPECT_THAT(sender_.sent, ElementsAre(kZeros, kZeros));
  deliver(nav_, "drive");
  EXPECT_THAT(sender_.sent, ElementsAre(kZeros, kZeros, "drive"));
  EXPECT_EQ(outgoing_.next(), shm::kForever);
  EXPECT_EQ(calls_, 1);
}

class StraightWithALockThatTimesOut : public StraightWithALock {
 protected:
  static constexpr shm::Nanoseconds kTimeout = 10'000'000;
  StraightWithALockThatTimesOut() : StraightWithALock("10ms") {}
};

// The turn sets the port's timer anew, which has expired and of which the loop has not heard yet.
TEST_F(StraightWithALockThatTimesOut, ATurnBetweenTheTimerAndTheLoopHidesNoIdlePort) {
  shm::Nanoseconds released = 0;
  while (outgoing_.next() != shm::kForever) {
    lock_.signal();
    deliver(nav_, "drive");
    released = shm::monotonic_now();
    outgoing_.run(released);
  }
  while (shm::monotonic_now() <= released + kTimeout) std::this_thread::yield();
  calls_ = 0;
  sender_.sent.clear();
  ASSERT_TRUE(outgoing_.begin_turn(1));
  EXPECT_FALSE(outgoing_.end_turn("/Nav/cmd:o", shm::kForever));
  EXPECT_EQ(calls_, 1);
  run();
  EXPECT_THAT(sender_.sent, ElementsAre(kZeros));
}

class StraightWithALockAndNoIdleSample : public StraightWithALock {
 protected:
  StraightWithALockAndNoIdleSample() : StraightWithALock("1000s", "idle='none'") {}
};

TEST_F(StraightWithALockAndNoIdleSample, APortThatBecomesIdleConcernsNobody) {
  lead_navigation();
  sender_.meanwhile = [this] { lock_.deactivate(); };
  deliver(nav_, "drive");
  EXPECT_EQ(calls_, 0);
  EXPECT_EQ(outgoing_.next(), shm::kForever);
  EXPECT_THAT(sender_.sent, ElementsAre("drive"));
}

}  // namespace
}  // namespace arbiter::gateway
