// A winner that cannot deliver: its port is idle, and what it inhibits stays inhibited.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <arbiter/arbiter.hpp>

#include "tests/client/component.hpp"
#include "tests/client/models.hpp"
#include "tests/client/samples.hpp"
#include "tests/support/await.hpp"
#include "tests/support/daemon.hpp"
#include "tests/support/hear_all.hpp"
#include "tests/support/readable.hpp"
#include "tests/support/threads.hpp"

namespace arbiter::test {
namespace {

using testing::HasSubstr;
using namespace std::chrono_literals;

constexpr auto kEver = std::chrono::hours::max();

NodeOptions quiet() {
  NodeOptions options;
  options.on_notice = [](const Notice&) {};
  return options;
}

struct OneFloat {
  float x = 0;
};

// /high is of a type that /in does not take. `timeout`: of all sources.
class Mismatch : public testing::TestWithParam<const char*> {
 protected:
  void SetUp() override { both_hear_all(); }
  void both_hear_all() {
    hear_all(sender);
    hear_all(receiver);
  }

  Daemon daemon{override_model(GetParam())};
  Node sender{"sender", quiet()};
  Node receiver{"receiver", quiet()};
  InputPort<Number> in = receiver.input_port<Number>("/in");
  OutputPort<Number> low = sender.output_port<Number>("/low");
};
INSTANTIATE_TEST_SUITE_P(, Mismatch, testing::Values("3600s", "forever"), [](const auto& each) {
  return std::string(each.param == std::string("forever") ? "Forever" : "Finite");
});

TEST_P(Mismatch, MakesItsPortIdleOnceAndLetsNobodyElseThrough) {
  low.publish(Number{1});
  EXPECT_EQ(take_from(in), 1);
  auto high = sender.output_port<OneFloat>("/high");
  both_hear_all();
  Watched waiting([&] { EXPECT_TRUE(in.wait_for(kEver).idle()); });
  waiting.wait_until_asleep();
  const Outcome outcome = high.publish(OneFloat{});
  waiting.join();
  EXPECT_EQ(outcome.delivered, 0u);
  EXPECT_EQ(outcome.discarded, 0u);
  EXPECT_EQ(outcome.refused, 1u);
  EXPECT_TRUE(in.idle());
  EXPECT_EQ(in.winner(), std::nullopt);
  EXPECT_EQ(low.publish(Number{2}).discarded, 1u) << "what it inhibits stays inhibited";
  EXPECT_FALSE(in.take());
  EXPECT_TRUE(in.wait_for(1ns).timed_out()) << "it is told once";
  EXPECT_EQ(daemon.input("/in")["idles"], 1);
  high.deactivate();
  EXPECT_EQ(in.winner(), "/low");
  EXPECT_EQ(low.publish(Number{3}).delivered, 1u);
  EXPECT_EQ(take_from(in), 3);
}

TEST_P(Mismatch, OfAPortThatWasThereFirstIsTheSame) {
  auto high = sender.output_port<OneFloat>("/high");
  high.publish(OneFloat{});
  in = receiver.input_port<Number>("/other");
  in = receiver.input_port<Number>("/in");
  both_hear_all();
  EXPECT_TRUE(in.idle());
  EXPECT_EQ(high.publish(OneFloat{}).refused, 1u);
}

TEST_P(Mismatch, IsDiscardedWhereItIsNotTheWinner) {
  auto high = sender.output_port<OneFloat>("/high");
  auto stop = sender.output_port<Number>("/stop");
  both_hear_all();
  stop.signal();
  const Outcome outcome = high.publish(OneFloat{});
  EXPECT_EQ(outcome.discarded, 1u);
  EXPECT_EQ(outcome.refused, 0u);
  EXPECT_EQ(high.signal().discarded, 1u);
  stop.deactivate();
  const Outcome signal = high.signal();
  EXPECT_EQ(signal.refused + signal.discarded + signal.delivered, 0u) << "nothing was to be sent";
}

TEST_P(Mismatch, IsOverWithASuccessorOfTheRightType) {
  {
    auto high = sender.output_port<OneFloat>("/high");
    both_hear_all();
    high.publish(OneFloat{});
    EXPECT_TRUE(in.idle());
  }
  auto high = sender.output_port<Number>("/high");
  both_hear_all();
  EXPECT_FALSE(in.idle()) << "its activity goes on, and it can deliver";
  EXPECT_EQ(in.winner(), "/high");
  EXPECT_EQ(high.publish(Number{1}).delivered, 1u);
  EXPECT_EQ(take_from(in), 1);
}

TEST_P(Mismatch, OfAnotherTypeThanBeforeIsOverWithTheReceiver) {
  auto high = sender.output_port<OneFloat>("/high");
  high.publish(OneFloat{});
  EXPECT_EQ(high.publish(OneFloat{}).refused, 1u);
  in = receiver.input_port<Number>("/other");
  auto fitting = receiver.input_port<OneFloat>("/in");
  both_hear_all();
  EXPECT_EQ(high.publish(OneFloat{}).delivered, 1u);
  EXPECT_EQ(fitting.winner(), "/high");
}

TEST_P(Mismatch, ShowsInTheStatus) {
  auto high = sender.output_port<OneFloat>("/high");
  both_hear_all();
  EXPECT_TRUE(daemon.input("/in")["cannot_deliver"].is_null());
  high.publish(OneFloat{});
  const auto status = daemon.input("/in");
  EXPECT_TRUE(status["idle"]);
  EXPECT_TRUE(status["winner"].is_null());
  EXPECT_EQ(status["cannot_deliver"]["source"], "/high");
  EXPECT_THAT(status["cannot_deliver"]["why"].get<std::string>(), HasSubstr("test::Number"));
  EXPECT_EQ(daemon.source("/high")["refused"], 1);
}

TEST_P(Mismatch, IsKnownToTheNextDaemonToo) {
  low.publish(Number{1});
  EXPECT_EQ(take_from(in), 1);
  auto high = sender.output_port<OneFloat>("/high");
  both_hear_all();
  high.publish(OneFloat{});
  EXPECT_TRUE(in.wait_for(kEver).idle());
  daemon.kill();
  EXPECT_TRUE(in.idle());
  EXPECT_EQ(high.publish(OneFloat{}).refused, 1u);
  daemon.restart();
  while (daemon.input("/in")["away"] == true || daemon.source("/high")["away"] == true) {
  }
  EXPECT_EQ(daemon.input("/in")["cannot_deliver"]["source"], "/high");
  EXPECT_TRUE(in.idle());
  EXPECT_EQ(high.publish(OneFloat{}).refused, 1u);
  EXPECT_TRUE(in.wait_for(1ns).timed_out()) << "it is told once";
  EXPECT_EQ(daemon.input("/in")["idles"], 1);
}

// The next daemon hears only from the receiver that there was such a thing.
TEST_P(Mismatch, ThatEndsWithoutADaemonIsOverWithTheNext) {
  Component wrong("wrong");
  in = receiver.input_port<Number>("/free");
  auto other = receiver.input_port<OneFloat>("/in");
  ASSERT_EQ(wrong.tell("output /high"), "open");
  both_hear_all();
  EXPECT_EQ(wrong.tell("publish /high 1"), "0 0 1");
  EXPECT_TRUE(other.idle());
  daemon.kill();
  wrong.kill();
  daemon.restart();
  while (daemon.input("/in")["away"] == true || daemon.source("/high")["away"] == true) {
  }
  auto high = sender.output_port<OneFloat>("/high");
  both_hear_all();
  EXPECT_EQ(other.winner(), "/high");
  EXPECT_EQ(high.publish(OneFloat{}).delivered, 1u);
}

TEST_P(Mismatch, MakesADescriptorReadableOnce) {
  const int fd = in.fd();
  low.publish(Number{1});
  EXPECT_EQ(take_from(in), 1);
  auto high = sender.output_port<OneFloat>("/high");
  both_hear_all();
  EXPECT_FALSE(in.take());
  EXPECT_FALSE(is_readable(fd));
  high.publish(OneFloat{});
  EXPECT_TRUE(is_readable(fd));
  EXPECT_FALSE(in.take());
  EXPECT_TRUE(in.idle());
  EXPECT_FALSE(is_readable(fd));
  high.publish(OneFloat{});
  low.publish(Number{2});
  EXPECT_FALSE(is_readable(fd)) << "losers wake nobody, and the port is idle already";
}

// Where nothing arbitrates, each connection commands by itself.
TEST(UselessWinner, OneOfSeveralAtAPortWithoutRulesLeavesTheOthers) {
  Daemon daemon(kNoRules, {.application = application(connection("/wrong", "/in") +
                                                      connection("/right", "/in"))});
  Node node("test", quiet());
  auto in = node.input_port<Number>("/in");
  auto wrong = node.output_port<OneFloat>("/wrong");
  auto right = node.output_port<Number>("/right");
  EXPECT_EQ(wrong.publish(OneFloat{}).refused, 1u);
  EXPECT_TRUE(in.idle());
  EXPECT_EQ(right.publish(Number{1}).delivered, 1u);
  EXPECT_FALSE(in.idle());
  EXPECT_EQ(take_from(in), 1);
  right.deactivate();
  EXPECT_TRUE(in.idle());
}

TEST(UselessWinner, AKilledCommanderWhoseActivityLastsForEverMakesThePortIdle) {
  Daemon daemon(override_model());
  Node node("test");
  auto low = node.output_port<Number>("/low");
  auto in = node.input_port<Number>("/in");
  Component commander("commander");
  ASSERT_EQ(commander.tell("output /high"), "open");
  ASSERT_EQ(commander.tell("publish /high 1"), "1 0 0");
  EXPECT_EQ((**in.wait_for(kEver)).value, 1);
  EXPECT_EQ(in.winner(), "/high");
  Watched waiting([&] { EXPECT_TRUE(in.wait_for(kEver).idle()); });
  waiting.wait_until_asleep();
  commander.kill();
  waiting.join();
  EXPECT_TRUE(in.idle());
  EXPECT_EQ(in.winner(), std::nullopt);
  EXPECT_EQ(low.publish(Number{2}).discarded, 1u) << "what it inhibits stays inhibited";
  EXPECT_TRUE(in.wait_for(1ns).timed_out()) << "it is told once";
  const auto status = daemon.input("/in");
  EXPECT_EQ(status["cannot_deliver"]["source"], "/high");
  EXPECT_THAT(status["cannot_deliver"]["why"].get<std::string>(),
              HasSubstr("arbiter deactivate /high"));
}

TEST(UselessWinner, WhatAKilledCommanderHasSentIsTakenFirst) {
  Daemon daemon(single_model());
  Node node("test");
  auto in = node.input_port<Number>("/in");
  Component commander("commander");
  ASSERT_EQ(commander.tell("output /out"), "open");
  ASSERT_EQ(commander.tell("publish /out 1 3"), "1 0 0");
  commander.kill();
  await([&] { return daemon.source("/out")["open"] != true; });
  EXPECT_FALSE(in.idle()) << "there is something to obey";
  EXPECT_EQ(in.winner(), "/out");
  for (int i = 1; i <= 3; ++i) EXPECT_EQ((**in.wait_for(kEver)).value, i);
  EXPECT_TRUE(in.wait_for(kEver).idle());
}

TEST(UselessWinner, ASourceThatIsOpenedAgainEndsTheIdleness) {
  Daemon daemon(single_model());
  Node node("test");
  auto in = node.input_port<Number>("/in");
  for (int i = 1; i <= 3; ++i) {
    {
      auto out = node.output_port<Number>("/out");
      EXPECT_EQ(in.idle(), i == 1);
      EXPECT_EQ(out.publish(Number{i}).delivered, 1u);
      EXPECT_EQ((**in.wait_for(kEver)).value, i);
      EXPECT_EQ(in.winner(), "/out");
    }
    EXPECT_TRUE(in.wait_for(kEver).idle());
    EXPECT_TRUE(in.wait_for(1ns).timed_out());
  }
  EXPECT_EQ(daemon.input("/in")["idles"], 3);
}

// A finite T ends by itself: until then a dead publisher is one that says nothing.
TEST(UselessWinner, WithAFiniteTADeadPublisherIsSilence) {
  Daemon daemon(single_model("3600s"));
  Node node("test");
  auto in = node.input_port<Number>("/in");
  Component commander("commander");
  ASSERT_EQ(commander.tell("output /out"), "open");
  ASSERT_EQ(commander.tell("publish /out 1"), "1 0 0");
  commander.kill();
  await([&] { return daemon.source("/out")["open"] != true; });
  EXPECT_EQ((**in.wait_for(kEver)).value, 1);
  EXPECT_FALSE(in.idle());
  EXPECT_EQ(in.winner(), "/out");
  EXPECT_TRUE(in.wait_for(1ns).timed_out());
}

// Not the model in force at the look counts, but that at the arrival.
TEST(UselessWinner, WhatLastsForEverSaysTheArrivalAndNotTheModelSince) {
  Daemon daemon(single_model());
  Node node("test");
  auto in = node.input_port<Number>("/in");
  { node.output_port<Number>("/out").publish(Number{1}); }
  daemon.load(single_model("3600s"));
  EXPECT_EQ((**in.wait_for(kEver)).value, 1);
  EXPECT_TRUE(in.wait_for(kEver).idle());
}

TEST(UselessWinner, AReceiverThatComesAfterTheDeathIsIdleToo) {
  Daemon daemon(single_model());
  Node node("test");
  { node.output_port<Number>("/out").signal(); }
  auto in = node.input_port<Number>("/in");
  EXPECT_TRUE(in.idle());
  auto out = node.output_port<Number>("/out");
  EXPECT_FALSE(in.idle());
}

// No daemon notices the death: the next one does.
TEST(UselessWinner, ACommanderThatDiesWithoutADaemonMakesThePortIdleWithTheNext) {
  Daemon daemon(single_model());
  Node node("test");
  auto in = node.input_port<Number>("/in");
  Component commander("commander");
  ASSERT_EQ(commander.tell("output /out"), "open");
  ASSERT_EQ(commander.tell("publish /out 1"), "1 0 0");
  EXPECT_EQ(take_from(in), 1);
  daemon.kill();
  commander.kill();
  Watched waiting([&] { EXPECT_TRUE(in.wait_for(kEver).idle()); });
  waiting.wait_until_asleep();
  daemon.restart();
  waiting.join();
}

TEST(UselessWinner, ACommanderThatLivesThroughTheDaemonsDeathGoesOnCommanding) {
  Daemon daemon(single_model());
  Node node("test");
  auto in = node.input_port<Number>("/in");
  auto out = node.output_port<Number>("/out");
  out.publish(Number{1});
  EXPECT_EQ(take_from(in), 1);
  daemon.kill();
  EXPECT_FALSE(in.idle());
  daemon.restart();
  EXPECT_TRUE(daemon.source("/out")["open"]);
  EXPECT_FALSE(in.idle());
  EXPECT_EQ(daemon.input("/in")["winner"], "/out");
}

}  // namespace
}  // namespace arbiter::test
