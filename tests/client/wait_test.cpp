// wait_for(): a sample, idle or a time-out, told apart; idle once for each change to idle.
#include <gtest/gtest.h>

#include <atomic>
#include <cmath>
#include <limits>
#include <thread>

#include <arbiter/arbiter.hpp>

#include "tests/client/component.hpp"
#include "tests/client/models.hpp"
#include "tests/client/samples.hpp"
#include "tests/support/daemon.hpp"
#include "tests/support/threads.hpp"

namespace arbiter::test {
namespace {

using namespace std::chrono_literals;

TEST(Wait, ASampleThatIsThereComesAtOnce) {
  Daemon daemon(single_model());
  Node node("test");
  auto out = node.output_port<Number>("/out");
  auto in = node.input_port<Number>("/in");
  out.publish(Number{7});
  auto result = in.wait_for(std::chrono::hours::max());
  ASSERT_TRUE(result);
  EXPECT_TRUE(result.has_value());
  EXPECT_EQ((**result).value, 7);
  EXPECT_EQ((*result)->value, 7);
  EXPECT_EQ(result.status(), WaitStatus::sample);
  EXPECT_FALSE(result.idle());
  EXPECT_FALSE(result.timed_out());
  EXPECT_EQ(result->source(), "/out");
}

TEST(Wait, ATimeThatHasPassedIsATimeOut) {
  Daemon daemon(single_model());
  Node node("test");
  auto in = node.input_port<Number>("/in");
  for (const auto timeout : {1ns, 0ns, -1ns, std::chrono::nanoseconds::min()}) {
    const auto result = in.wait_for(timeout);
    EXPECT_FALSE(result);
    EXPECT_TRUE(result.timed_out());
    EXPECT_EQ(result.status(), WaitStatus::timeout);
  }
  EXPECT_TRUE(in.wait_for(std::chrono::hours::min()).timed_out());
  EXPECT_TRUE(in.wait_for(std::chrono::duration<double>(1e-9)).timed_out());
  EXPECT_TRUE(in.wait_for(std::chrono::duration<double>(std::nan(""))).timed_out());
}

TEST(Wait, AnyLengthOfTimeIsPossible) {
  Daemon daemon(single_model());
  Node node("test");
  auto out = node.output_port<Number>("/out");
  auto in = node.input_port<Number>("/in");
  const auto wait_for = [&](auto timeout) {
    std::thread sender([&] { out.publish(Number{1}); });
    EXPECT_TRUE(in.wait_for(timeout));
    sender.join();
  };
  wait_for(std::chrono::hours::max());
  wait_for(std::chrono::nanoseconds::max());
  wait_for(std::chrono::duration<double>(1e300));
  wait_for(std::chrono::duration<double>(std::numeric_limits<double>::infinity()));
}

TEST(Wait, ABlockedReceiverIsWokenByASample) {
  Daemon daemon(single_model());
  Node node("test");
  auto out = node.output_port<Number>("/out");
  auto in = node.input_port<Number>("/in");
  Watched receiver([&] {
    auto result = in.wait_for(std::chrono::hours::max());
    ASSERT_TRUE(result);
    EXPECT_EQ((**result).value, 7);
  });
  receiver.wait_until_asleep();
  out.publish(Number{7});
  receiver.join();
}

TEST(Wait, NoSampleIsLeftWaitingHoweverTheTwoMeet) {
  Daemon daemon(single_model());
  Node node("test");
  auto there = node.output_port<Number>("/out");
  auto in = node.input_port<Number>("/in", {.depth = 4, .when_full = refuse_new});
  constexpr std::int64_t kSamples = 30000;
  std::thread sender([&] {
    for (std::int64_t i = 0; i < kSamples;) i += there.publish(Number{i}).delivered;
  });
  for (std::int64_t i = 0; i < kSamples; ++i) {
    auto result = in.wait_for(std::chrono::hours::max());
    ASSERT_TRUE(result);
    ASSERT_EQ((**result).value, i);
  }
  sender.join();
}

TEST(Wait, IdleIsToldOnceForEachChangeToIdle) {
  Daemon daemon(override_model());
  Node node("test");
  auto low = node.output_port<Number>("/low");
  auto in = node.input_port<Number>("/in");
  EXPECT_TRUE(in.wait_for(1ns).timed_out()) << "it has not become idle: it was";
  for (int i = 0; i < 3; ++i) {
    low.publish(Number{i});
    EXPECT_TRUE(in.wait_for(1ns));
    EXPECT_TRUE(in.wait_for(1ns).timed_out());
    low.deactivate();
    EXPECT_TRUE(in.wait_for(std::chrono::hours::max()).idle());
    EXPECT_TRUE(in.wait_for(1ns).timed_out()) << "told once";
  }
  EXPECT_EQ(daemon.input("/in")["idles"], 3);
}

// Whatever has shown it a commander: it may have set its motor moving by that.
TEST(Wait, IdleIsToldAfterACommanderThatWasOnlyAskedFor) {
  Daemon daemon(override_model());
  Node node("test");
  auto low = node.output_port<Number>("/low");
  auto in = node.input_port<Number>("/in");
  const auto is_told_after = [&](const auto& asks) {
    low.signal();
    asks();
    low.deactivate();
    return in.wait_for(1ns).idle();
  };
  EXPECT_TRUE(is_told_after([&] { EXPECT_FALSE(in.idle()); }));
  EXPECT_TRUE(is_told_after([&] { EXPECT_EQ(in.winner(), "/low"); }));
  EXPECT_FALSE(is_told_after([] {})) << "of what it has not seen it is not told";
}

TEST(Wait, ASampleComesBeforeIdle) {
  Daemon daemon(single_model());
  Node node("test");
  auto out = node.output_port<Number>("/out");
  auto in = node.input_port<Number>("/in");
  out.publish(Number{1});
  out.deactivate();
  EXPECT_TRUE(in.wait_for(1ns)) << "its own end of activity does not drop a sample";
  EXPECT_TRUE(in.wait_for(std::chrono::hours::max()).idle());
}

TEST(Wait, ACommanderThatFallsSilentMakesThePortIdle) {
  Daemon daemon(single_model("20ms"));
  Node node("test");
  auto out = node.output_port<Number>("/out");
  auto in = node.input_port<Number>("/in");
  for (int i = 0; i < 3; ++i) {
    out.publish(Number{i});
    EXPECT_TRUE(in.wait_for(std::chrono::hours::max()));
    EXPECT_TRUE(in.wait_for(std::chrono::hours::max()).idle());
  }
}

TEST(Wait, ACommanderThatOnlySignalsMakesThePortIdleWhenItFallsSilent) {
  Daemon daemon(single_model("20ms"));
  Node node("test");
  auto out = node.output_port<Number>("/out");
  auto in = node.input_port<Number>("/in");
  std::atomic<bool> is_told{false};
  Watched receiver([&] {
    EXPECT_TRUE(in.wait_for(std::chrono::hours::max()).idle());
    is_told = true;
  });
  receiver.wait_until_asleep();
  while (!is_told) {  // of what it has not seen it is not told, and it may not run for 20 ms
    out.signal();
    while (daemon.source("/out")["active"] == true) {
    }
  }
  receiver.join();
}

// Low takes over by the mere passing of time, and is silent itself: still somebody commands.
TEST(Wait, APortIsNotIdleWhileAnotherTakesOverByTimeAlone) {
  Daemon daemon(rules("<source port=\"/high\" timeout=\"10ms\"/>" +
                          arbiter_at("/in", select("/low", "not /high") + select("/high")),
                      "forever"));
  Node node("test");
  auto low = node.output_port<Number>("/low");
  auto high = node.output_port<Number>("/high");
  auto in = node.input_port<Number>("/in");
  low.signal();
  high.publish(Number{1});
  EXPECT_TRUE(in.wait_for(std::chrono::hours::max()));
  Watched receiver([&] { EXPECT_TRUE(in.wait_for(std::chrono::hours::max()).idle()); });
  while (in.name().empty() || daemon.source("/high")["active"]) {
  }
  EXPECT_EQ(daemon.input("/in")["winner"], "/low");
  low.deactivate();
  receiver.join();
}

TEST(Wait, AnOverrideThatOnlySaysStopMakesThePortIdle) {
  Daemon daemon(override_model());
  Node node("test");
  auto low = node.output_port<Number>("/low");
  auto stop = node.output_port<Number>("/stop");
  auto in = node.input_port<Number>("/in");
  low.publish(Number{1});
  EXPECT_TRUE(in.wait_for(1ns));
  Watched receiver([&] { EXPECT_TRUE(in.wait_for(std::chrono::hours::max()).idle()); });
  receiver.wait_until_asleep();
  stop.signal();
  receiver.join();
  EXPECT_TRUE(in.wait_for(1ns).timed_out());
}

TEST(Wait, TheFirstSignalOfAProcessThatHasOnlyJustBeenStartedMakesThePortIdle) {
  Daemon daemon(override_model());
  Node node("test");
  auto low = node.output_port<Number>("/low");
  auto in = node.input_port<Number>("/in");
  low.publish(Number{1});
  EXPECT_TRUE(in.wait_for(1ns));
  Watched receiver([&] { EXPECT_TRUE(in.wait_for(std::chrono::hours::max()).idle()); });
  Component brake("brake");
  ASSERT_EQ(brake.tell("output /stop"), "open");
  brake.tell("signal /stop");
  receiver.join();
}

TEST(Wait, ANewModelThatSelectsNobodyMakesThePortIdle) {
  Daemon daemon(override_model());
  Node node("test");
  auto low = node.output_port<Number>("/low");
  auto in = node.input_port<Number>("/in");
  low.publish(Number{1});
  EXPECT_TRUE(in.wait_for(1ns));
  Watched receiver([&] { EXPECT_TRUE(in.wait_for(std::chrono::hours::max()).idle()); });
  receiver.wait_until_asleep();
  daemon.load(rules(arbiter_at("/in", select("/low", "/stop"))));
  receiver.join();
}

TEST(Wait, APublisherThatIsKilledBetweenDeliveringAndRingingStillWakes) {
  Daemon daemon(single_model());
  Node node("test");
  auto in = node.input_port<Number>("/in");
  Component sender("sender");
  ASSERT_EQ(sender.tell("output /out"), "open");
  Watched receiver([&] { EXPECT_TRUE(in.wait_for(std::chrono::hours::max())); });
  receiver.wait_until_asleep();
  sender.begin("publish /out 1 100000000");
  receiver.join();
  sender.kill();  // in the midst of publishing
  while (in.take()) {
  }
  auto successor = node.output_port<Number>("/out");
  EXPECT_EQ(successor.publish(Number{5}).delivered, 1u);
  EXPECT_EQ((**in.wait_for(std::chrono::hours::max())).value, 5);
}

void spin(int rounds) {
  for (std::atomic<int> i{0}; i < rounds; ++i) {
  }
}

// A wait that ends in an exception must not leave the port believing that it does not wait when it
// does.
TEST(Wait, NoWakeUpIsLostAfterAWaitThatThrew) {
  Daemon daemon(single_model());
  Node node("test");
  auto out = node.output_port<Number>("/out");
  auto in = node.input_port<Number>("/in");
  constexpr int kRounds = 3000;
  std::atomic<int> turn{0};
  std::thread sender([&] {
    for (int i = 1; i <= 2 * kRounds; ++i) {
      while (turn.load() < i) {
      }
      if (i % 2 != 0) spin(3000);  // so that it sleeps by now
      out.publish(Number{i});
    }
  });
  for (int i = 0; i < kRounds; ++i) {
    turn = 2 * i + 1;
    {
      const auto held = in.wait_for(std::chrono::hours::max());
      turn = 2 * i + 2;
      spin(i % 100);  // so that the sample comes at any moment of the wait
      EXPECT_THROW(static_cast<void>(in.wait_for(std::chrono::hours::max())), Error);
    }
    EXPECT_TRUE(in.wait_for(std::chrono::hours::max()));
  }
  sender.join();
}

TEST(Wait, ASignalToTheProcessDoesNotEndAWait) {
  struct sigaction ignore {};
  ignore.sa_handler = [](int) {};
  struct sigaction before {};
  sigaction(SIGUSR1, &ignore, &before);
  Daemon daemon(single_model());
  Node node("test");
  auto out = node.output_port<Number>("/out");
  auto in = node.input_port<Number>("/in");
  Watched receiver([&] { EXPECT_TRUE(in.wait_for(std::chrono::hours::max())); });
  for (int i = 0; i < 10; ++i) {
    receiver.wait_until_asleep();
    receiver.signal(SIGUSR1);
  }
  receiver.wait_until_asleep();
  out.publish(Number{1});
  receiver.join();
  sigaction(SIGUSR1, &before, nullptr);
}

}  // namespace
}  // namespace arbiter::test
