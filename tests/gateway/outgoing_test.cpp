// What an input port takes is sent outside, and what is sent while it is idle. The tests say what
// time it is, except for the age of a sample, which bears its own.
#include <gmock/gmock.h>

#include <arbiter/arbiter.hpp>

#include "shm/clock.hpp"
#include "tests/gateway/foreign.hpp"
#include "tests/gateway/mapping_text.hpp"
#include "tests/realtime/allocations.hpp"
#include "tests/support/await.hpp"
#include "tests/support/daemon.hpp"

namespace arbiter::gateway {
namespace {

using testing::ElementsAre;
using testing::IsEmpty;
using testing::SizeIs;

constexpr const char* kDepartures =
    "<behaviors timeout='10s'>"
    "<behavior name='Drive'><config at='/Base/cmd:i'>/Nav/cmd:o</config></behavior>"
    "</behaviors>";

class Leaving : public testing::Test {
 protected:
  explicit Leaving(const std::string& idle = "idle='zero' size='4'")
      : read_(read_dds("<out port='/Base/cmd:i' topic='/cmd' type='a/msg/B' " + idle + "/>")),
        entry_(read_.entry()),
        account_(entry_.outside(), "subscriber") {}

  OutputPort<void> publisher() {
    return node_.output_port("/Nav/cmd:o", Type::variable("a/msg/B", 64));
  }
  void publish(OutputPort<void>& port, const std::string& bytes) {
    port.publish(Bytes(reinterpret_cast<const std::byte*>(bytes.data()), bytes.size()));
  }

  test::Daemon daemon_{kDepartures};
  Read read_;
  const Entry& entry_;
  Account account_;
  KeepingSender sender_;
  OneAge ages_;
  Node node_{"gateway"};
  Outgoing outgoing_{node_, entry_, sender_, account_, ages_};
  shm::Nanoseconds now_ = shm::monotonic_now();
};

TEST_F(Leaving, WhatWinsIsSent) {
  auto nav = publisher();
  publish(nav, "one");
  publish(nav, "two");
  outgoing_.run(now_);
  EXPECT_THAT(sender_.sent, ElementsAre("one", "two"));
  EXPECT_EQ(account_.passed.value(), 2u);
  EXPECT_EQ(outgoing_.next(), shm::kForever) << "somebody commands";
}

class LeavingFew : public Leaving {
 protected:
  LeavingFew() : Leaving("queue='2'") {}
};

TEST_F(LeavingFew, AsManyWaitAsTheMappingSays) {
  auto nav = publisher();
  for (const char* const each : {"one", "two", "three"}) publish(nav, each);
  outgoing_.run(now_);
  EXPECT_THAT(sender_.sent, ElementsAre("two", "three"));
}

TEST_F(Leaving, AnIdlePortSaysStopAtOnceAndAgainEvery100Milliseconds) {
  outgoing_.run(now_);
  EXPECT_THAT(sender_.sent, ElementsAre(kZeros)) << "at the start";
  EXPECT_EQ(outgoing_.next(), now_ + Outgoing::kIdlePeriod);
  outgoing_.run(now_ + Outgoing::kIdlePeriod - 1);
  EXPECT_THAT(sender_.sent, SizeIs(1));
  outgoing_.run(now_ + Outgoing::kIdlePeriod);
  EXPECT_THAT(sender_.sent, SizeIs(2));
  EXPECT_EQ(account_.idle.value(), 2u);
  EXPECT_EQ(account_.passed.value(), 0u);
}

TEST_F(Leaving, APortThatBecomesIdleSaysStopAtOnce) {
  outgoing_.run(now_);
  auto nav = publisher();
  publish(nav, "drive");
  outgoing_.run(now_ + 1);
  nav.deactivate();
  outgoing_.run(now_ + 2);
  EXPECT_THAT(sender_.sent, ElementsAre(kZeros, "drive", kZeros));
}

// The loop sees the port idle before and after, and has sent a command in between.
TEST_F(Leaving, APortThatBecomesIdleWhileACommandIsSentSaysStopAtOnce) {
  outgoing_.run(now_);
  auto nav = publisher();
  publish(nav, "drive");
  sender_.meanwhile = [&] { nav.deactivate(); };
  outgoing_.run(now_ + 1);
  EXPECT_THAT(sender_.sent, ElementsAre(kZeros, "drive", kZeros));
}

// A subscriber that is full holds up what comes behind, which grows old meanwhile.
TEST_F(Leaving, WhatGrowsOldWhileAnotherSampleIsSentIsNotSent) {
  auto nav = publisher();
  const shm::Nanoseconds before = shm::monotonic_now();
  publish(nav, "held up");
  publish(nav, "old");
  const shm::Nanoseconds after = shm::monotonic_now();
  sender_.meanwhile = [&] {
    ages_.age = after - before;
    while (shm::monotonic_now() - after <= ages_.age) {
    }
  };
  outgoing_.run(after);
  EXPECT_THAT(sender_.sent, ElementsAre("held up", kZeros)) << "its last word is not known";
  EXPECT_EQ(account_.late.value(), 1u);
}

TEST_F(Leaving, AReaderThatComesIsToldToStop) {
  outgoing_.run(now_);
  outgoing_.peer_matched();
  outgoing_.run(now_ + 1);
  EXPECT_THAT(sender_.sent, SizeIs(2));
  outgoing_.run(now_ + 2);
  EXPECT_THAT(sender_.sent, SizeIs(2));
}

TEST_F(Leaving, WhatHasWaitedForLongerThanTIsNotSent) {
  auto nav = publisher();
  publish(nav, "old");
  ages_.age = 1'000'000'000;
  outgoing_.run(shm::monotonic_now() + 2'000'000'000);
  EXPECT_THAT(sender_.sent, ElementsAre(kZeros));
  EXPECT_EQ(account_.late.value(), 1u);
}

TEST_F(Leaving, ASampleCostsNoAllocation) {
  auto nav = publisher();
  const auto send = [&] {
    publish(nav, "x");
    sender_.sent.clear();
    outgoing_.run(now_);
  };
  sender_.sent.reserve(1);
  send();
  const auto before = test::allocations_of_this_thread();
  for (int i = 0; i < 100; ++i) send();
  EXPECT_EQ(test::allocations_of_this_thread(), before);
  EXPECT_EQ(account_.passed.value(), 101u);
}

TEST_F(Leaving, WhatCannotBeSentIsCounted) {
  auto nav = publisher();
  for (const auto answer :
       {Sender::Result::kNotReady, Sender::Result::kRefused, Sender::Result::kNoMemory,
        Sender::Result::kTooLarge, Sender::Result::kUnreadable}) {
    sender_.answer = answer;
    publish(nav, "x");
    outgoing_.run(now_);
  }
  EXPECT_EQ(account_.refused.value(), 2u);
  EXPECT_EQ(account_.unreadable.value(), 1u);
  EXPECT_EQ(account_.no_slot.value(), 1u);
  EXPECT_EQ(account_.too_large.value(), 1u);
}

// The base would go on with the last command that it has heard.
TEST_F(Leaving, WhileTheWinnersSamplesCannotBeSentThePortSaysStop) {
  auto nav = publisher();
  for (const auto answer :
       {Sender::Result::kNotReady, Sender::Result::kRefused, Sender::Result::kNoMemory,
        Sender::Result::kTooLarge, Sender::Result::kUnreadable}) {
    sender_.answers = {answer};
    publish(nav, "lost");
    outgoing_.run(now_);
    EXPECT_THAT(sender_.sent, ElementsAre(kZeros)) << static_cast<int>(answer);
    EXPECT_EQ(outgoing_.next(), now_ + Outgoing::kIdlePeriod);
    sender_.answers = {answer};
    publish(nav, "lost");
    outgoing_.run(now_ + 1);
    EXPECT_THAT(sender_.sent, SizeIs(1)) << "as often as to an idle port";
    outgoing_.run(now_ + Outgoing::kIdlePeriod);
    EXPECT_THAT(sender_.sent, ElementsAre(kZeros, kZeros));
    publish(nav, "drive");
    outgoing_.run(now_ + Outgoing::kIdlePeriod + 1);
    EXPECT_THAT(sender_.sent, ElementsAre(kZeros, kZeros, "drive"));
    EXPECT_EQ(outgoing_.next(), shm::kForever) << "one is sent";
    sender_.sent.clear();
  }
  EXPECT_EQ(account_.idle.value(), 10u);
}

// Of a source whose T is for ever, say: it still commands, but the base has heard somebody else
// last.
TEST_F(Leaving, WhileTheWinnersLastSampleIsTooOldThePortSaysStop) {
  auto nav = publisher();
  publish(nav, "drive");
  outgoing_.run(now_);
  publish(nav, "old");
  ages_.age = 1'000'000'000;
  now_ = shm::monotonic_now() + 2 * ages_.age;
  outgoing_.run(now_);
  EXPECT_THAT(sender_.sent, ElementsAre("drive", kZeros));
  EXPECT_EQ(outgoing_.next(), now_ + Outgoing::kIdlePeriod);
  publish(nav, "on");
  outgoing_.run(shm::monotonic_now());
  EXPECT_THAT(sender_.sent, ElementsAre("drive", kZeros, "on"));
  EXPECT_EQ(outgoing_.next(), shm::kForever);
}

TEST_F(Leaving, OfSeveralSamplesTheLastOneSaysWhetherTheWinnerIsHeard) {
  auto nav = publisher();
  sender_.answers = {Sender::Result::kRefused};
  publish(nav, "lost");
  publish(nav, "drive");
  outgoing_.run(now_);
  EXPECT_THAT(sender_.sent, ElementsAre("drive"));
}

TEST_F(Leaving, ItsDescriptorIsReadableWhenThereIsSomethingToDo) {
  outgoing_.run(now_);
  auto nav = publisher();
  pollfd polled{outgoing_.descriptor(), POLLIN, 0};
  for (int i = 0; i < 3; ++i) {
    publish(nav, "x");
    ASSERT_EQ(::poll(&polled, 1, -1), 1);
    outgoing_.run(now_);
  }
  nav.deactivate();
  ASSERT_EQ(::poll(&polled, 1, -1), 1);
}

class LeavingSilently : public Leaving {
 protected:
  LeavingSilently() : Leaving("idle='none'") {}
};

TEST_F(LeavingSilently, NothingIsSentWhileThePortIsIdle) {
  outgoing_.run(now_);
  EXPECT_THAT(sender_.sent, IsEmpty());
  EXPECT_EQ(outgoing_.next(), shm::kForever);
}

// What a gateway says of an entry reaches the status, and the next daemon.
TEST_F(Leaving, ItsDescriptionIsInTheStatusOfEachDaemon) {
  outgoing_.describe("DDS topic rt/cmd, no subscriber matched\x1b[2J", false);
  const auto described = [this] {
    const auto input = daemon_.input("/Base/cmd:i");
    return input.contains("described") ? input["described"].get<std::string>() : std::string();
  };
  const std::string text = "DDS topic rt/cmd, no subscriber matched\\x1b[2J";
  test::await([&] { return described() == text; });
  daemon_.kill();
  daemon_.restart();
  test::await([&] { return described() == text; });
  outgoing_.describe("", false);
  test::await([&] { return described().empty(); });
}

}  // namespace
}  // namespace arbiter::gateway
