// A sample that goes straight on: whoever delivers it sends what becomes of it, and the loop is
// neither woken nor needed, unless there is something that it alone can do.
#include <gmock/gmock.h>

#include <atomic>
#include <string>
#include <thread>

#include "tests/gateway/straight_scene.hpp"
#include "tests/realtime/allocations.hpp"

namespace arbiter::gateway {
namespace {

using testing::ElementsAre;
using testing::IsEmpty;

TEST_F(Straight, WhoeverDeliversASampleSendsItAndTheLoopSleeps) {
  lead_navigation();
  for (const std::string sample : {"a", "b", "c"}) {
    EXPECT_EQ(deliver(nav_, sample), Incoming::Fate::kPassed);
    EXPECT_EQ(sender_.sent.back(), sample);
    EXPECT_FALSE(calls_loop());
  }
  EXPECT_EQ(calls_, 0);
  EXPECT_EQ(account_.passed.value(), 4u);
  EXPECT_EQ(nav_account_.passed.value(), 4u);
  EXPECT_EQ(outgoing_.next(), shm::kForever);
}

TEST_F(Straight, AnotherSourceThatTakesOverIsSentByTheLoopAndThenStraight) {
  lead_navigation();
  deliver(teleop_, "stop");
  EXPECT_TRUE(calls_loop());
  run();
  EXPECT_THAT(sender_.sent, ElementsAre("stop"));
  deliver(teleop_, "back");
  EXPECT_FALSE(calls_loop());
  EXPECT_THAT(sender_.sent, ElementsAre("stop", "back"));
}

TEST_F(Straight, ASourceThatLosesIsNotSentAndWinsAgainByTheLoop) {
  lead_navigation();
  auto stop = this->stop();
  publish(stop, "stop");
  run();
  deliver(nav_, "loses");
  EXPECT_FALSE(calls_loop());
  EXPECT_THAT(sender_.sent, ElementsAre("stop"));
  stop.deactivate();
  run();
  deliver(nav_, "wins");
  EXPECT_TRUE(calls_loop());
  run();
  deliver(nav_, "straight");
  EXPECT_FALSE(calls_loop());
  EXPECT_THAT(sender_.sent, ElementsAre("stop", "wins", "straight"));
}

// Between what the thread publishes and what it takes, another component has overridden it.
TEST_F(Straight, WhatComesFromOthersMeanwhileIsLeftToTheLoopInItsOrder) {
  lead_navigation();
  auto stop = this->stop();
  ASSERT_TRUE(outgoing_.begin_turn(1));
  publish(stop, "stop");
  EXPECT_FALSE(outgoing_.end_turn("/Nav/cmd:o", shm::kForever));
  EXPECT_EQ(calls_, 1);
  EXPECT_EQ(outgoing_.next(), 0);
  EXPECT_FALSE(outgoing_.begin_turn(1)) << "nobody overtakes what is left";
  publish(stop, "again");
  EXPECT_THAT(sender_.sent, IsEmpty());
  outgoing_.run(shm::monotonic_now());
  EXPECT_THAT(sender_.sent, ElementsAre("stop", "again"));
  EXPECT_EQ(outgoing_.next(), shm::kForever);
  publish(stop, "more");
  EXPECT_TRUE(calls_loop());
}

TEST_F(Straight, NobodyTakesATurnThatSomebodyHas) {
  lead_navigation();
  ASSERT_TRUE(outgoing_.begin_turn(1));
  EXPECT_FALSE(outgoing_.begin_turn(1));
  deliver(nav_, "waits");
  EXPECT_THAT(sender_.sent, IsEmpty());
  EXPECT_TRUE(outgoing_.end_turn("/Nav/cmd:o", shm::kForever));
  EXPECT_THAT(sender_.sent, ElementsAre("waits"));
}

TEST_F(Straight, WhatHasBecomeTooOldOnTheWayIsNotSent) {
  lead_navigation();
  ASSERT_TRUE(outgoing_.begin_turn(1));
  deliver(nav_, "old");
  EXPECT_TRUE(outgoing_.end_turn("/Nav/cmd:o", 0));
  EXPECT_THAT(sender_.sent, IsEmpty());
  EXPECT_EQ(account_.late.value(), 1u);
}

TEST_F(Straight, ASampleForWhichTheSenderWouldWaitIsLeftToTheLoop) {
  lead_navigation();
  sender_.would_wait = true;
  deliver(nav_, "large");
  deliver(nav_, "next");
  EXPECT_THAT(sender_.sent, IsEmpty());
  EXPECT_EQ(calls_, 1);
  EXPECT_EQ(outgoing_.next(), 0);
  run();
  EXPECT_THAT(sender_.sent, ElementsAre("large", "next"));
  EXPECT_EQ(account_.passed.value(), 3u);
}

// To send it would hold up the thread that delivers, and with it what comes next.
TEST_F(Straight, ALargeSampleIsSentByTheLoop) {
  lead_navigation();
  sender_.largest = 5;
  deliver(nav_, "12345");
  EXPECT_FALSE(calls_loop());
  EXPECT_THAT(sender_.sent, ElementsAre("12345"));
  deliver(nav_, "123456");
  EXPECT_TRUE(calls_loop());
  EXPECT_THAT(sender_.sent, ElementsAre("12345"));
  run();
  EXPECT_THAT(sender_.sent, ElementsAre("12345", "123456"));
  deliver(nav_, "small");
  EXPECT_FALSE(calls_loop());
  EXPECT_THAT(sender_.sent, ElementsAre("12345", "123456", "small"));
  EXPECT_EQ(calls_, 0);
}

TEST_F(Straight, NobodySendsALargeSampleThatTheLoopHasNotComeToYetNorOvertakesIt) {
  lead_navigation();
  sender_.largest = 5;
  deliver(nav_, "123456");
  deliver(nav_, "small");
  deliver(nav_, "next");
  EXPECT_THAT(sender_.sent, IsEmpty());
  EXPECT_EQ(calls_, 1);
  run();
  EXPECT_THAT(sender_.sent, ElementsAre("123456", "small", "next"));
}

TEST_F(Straight, ASampleCostsNoAllocation) {
  lead_navigation();
  sender_.sent.reserve(1);
  const BytesSample sample("x");
  const auto before = test::allocations_of_this_thread();
  for (int i = 0; i < 100; ++i) {
    sender_.sent.clear();
    nav_.deliver(sample, Time::max());
  }
  EXPECT_EQ(test::allocations_of_this_thread(), before);
  EXPECT_EQ(account_.passed.value(), 101u);
}

// A mapping whose entries nobody has compared with the model.
class OtherHeaders : public testing::Test {
 protected:
  OtherHeaders() {
    for (const Port* port : in_.entry().ports()) feeds_.emplace(port->name, &in_.feed());
    outgoing_.lead(feeds_, [] {});
  }
  Incoming::Fate deliver(const std::string& bytes) {
    return in_.deliver(BytesSample(bytes, 8), Time::max());
  }

  test::Daemon daemon_{
      "<behaviors timeout='1000s'><behavior name='Navigate'><config at='/Base/cmd:i'>/Low:o"
      "</config></behavior><behavior name='Hurry'><config at='/Base/cmd:i'>/High:o</config>"
      "<inhibition>Navigate</inhibition></behavior></behaviors>"};
  Read read_ = read_iceoryx(
      "<in service='a' instance='b' event='c' above='/High:o' below='/Low:o' field='u8' "
      "threshold='5' user_header='8'/>"
      "<out port='/Base/cmd:i' service='a' instance='b' event='d' size='4' idle='zero'/>");
  Account in_account_{"nav", "publisher"};
  Account account_{"cmd", "subscriber"};
  KeepingSender sender_;
  OneAge ages_;
  FeedBySource feeds_;
  Node node_{"gateway"};
  Incoming in_{node_, read_.entry(0), in_account_};
  Outgoing outgoing_{node_, read_.entry(1), sender_, account_, ages_};
};

// Neither of two sources: the header would be the command.
TEST_F(OtherHeaders, WhatBeginsWithAnotherHeaderIsNotSent) {
  const std::string zeros(4, '\0');
  outgoing_.run(shm::monotonic_now());
  for (const char speed : {'\1', '\7'}) {
    EXPECT_EQ(deliver(std::string(8, 'h') + speed), Incoming::Fate::kPassed);
    outgoing_.run(shm::monotonic_now());
  }
  EXPECT_THAT(sender_.sent, testing::Each(zeros));
  EXPECT_EQ(account_.unreadable.value(), 2u);
  EXPECT_EQ(account_.passed.value(), 0u);
  EXPECT_THAT(account_.text(),
              testing::EndsWith("2 unreadable; the last bad sample has a user header of 8 "
                                "bytes; write user_header=\"8\" at the <out>"));
}

// One that delivers and the loop meet at one port: no sample is sent twice, none out of order, and
// the last one is not forgotten.
TEST_F(Straight, ThreadsTakeTurns) {
  constexpr int kSamples = 5000;
  std::atomic<bool> ends = false;
  outgoing_.lead(feeds_, [] {});
  std::thread loop([&] {
    while (!ends) {
      run();
      std::this_thread::yield();
    }
  });
  for (int i = 0; i < kSamples; ++i) deliver(nav_, std::to_string(i));
  ends = true;
  loop.join();
  outgoing_.run(shm::monotonic_now());
  int next = 0;
  for (const std::string& sample : sender_.sent) {
    EXPECT_GE(std::stoi(sample), next);
    next = std::stoi(sample) + 1;
  }
  EXPECT_EQ(next, kSamples);
}

}  // namespace
}  // namespace arbiter::gateway
