// RouDi absent, killed, ended and stopped hurts only the gateway, which says so and comes back.
#include <gmock/gmock.h>

#include <csignal>

#include <arbiter/arbiter.hpp>

#include "shm/clock.hpp"
#include "tests/gateway/iceoryx/scene.hpp"

namespace arbiter::test {
namespace {

using testing::HasSubstr;

TEST_F(Iceoryx, WithoutRouDiTheGatewaySaysSoAndGoesOnLooking) {
  Spoken gate = gateway(directory_, in("low", "/Low:o") + out("/Base:i", "base"));
  ASSERT_TRUE(gate.hear("/Low:o comes from iceoryx Test/One/low, RouDi does not run"))
      << gate.heard;
  wait_for_description("/Low:o", "RouDi does not run");
  const Roudi roudi(directory_);
  expect_that_samples_pass();
}

TEST_F(Iceoryx, ARouDiThatIsKilledAndComesAgainIsFoundAgain) {
  std::optional<Roudi> roudi(directory_);
  Spoken gate = gateway(directory_, in("low", "/Low:o") + out("/Base:i", "base"));
  wait_for_description("/Low:o", "no publisher matched");
  for (int i = 0; i < 2; ++i) {
    roudi->process.kill();
    ASSERT_TRUE(gate.hear("RouDi has gone; the gateway begins anew")) << gate.heard;
    wait_for_description("/Low:o", "RouDi does not run");
    roudi.emplace(directory_);
    expect_that_samples_pass();
  }
}

// RouDi ends all that it knows when it is ended itself.
TEST_F(Iceoryx, ARouDiThatIsEndedEndsTheWorkerAndNotTheGateway) {
  std::optional<Roudi> roudi(directory_);
  Spoken gate = gateway(directory_, in("low", "/Low:o"));
  wait_for_description("/Low:o", "no publisher matched");
  roudi->process.signal(SIGTERM);
  wait_for_description("/Low:o", "RouDi does not run");
  roudi->process.wait();
  roudi.emplace(directory_);
  wait_for_description("/Low:o", "no publisher matched");
  EXPECT_TRUE(gate.process.runs());
}

TEST_F(Iceoryx, ARouDiThatHangsIsToldAndHoldsUpNobodyElse) {
  Roudi roudi(directory_);
  roudi.process.stop();
  Spoken gate = gateway(directory_, in("low", "/Low:o"));
  wait_for_description("/Low:o", "RouDi does not answer");
  roudi.process.resume();
  wait_for_description("/Low:o", "no publisher matched");
}

TEST_F(Iceoryx, ARouDiThatHangsLaterIsToldAndWhatIsConnectedGoesOn) {
  Roudi roudi(directory_);
  Spoken gate = gateway(directory_, in("low", "/Low:o") + out("/Base:i", "base"));
  Spoken publisher = plain_publisher("low");
  Spoken subscriber = plain_subscriber("base");
  ASSERT_TRUE(subscriber.hear("ready"));
  wait_for_description("/Low:o", "1 publisher matched");
  roudi.process.stop();
  const auto stopped = shm::monotonic_now();
  wait_for_description("/Low:o", "RouDi does not answer");
  // One that runs and is silent for so long has given the gateway up. This one has not.
  wait_until([&] { return shm::monotonic_now() - stopped > 11'000'000'000; });
  publisher.say("x");
  EXPECT_EQ(subscriber.line(), "|x");
  // Whether it then gives up those whom it has not heard of, or not.
  roudi.process.resume();
  wait_until(
      [&] { return described("/Low:o").find("RouDi does not answer") == std::string::npos; });
  const Spoken anyone = plain_publisher("low");
  wait_until([&] {
    const std::string text = described("/Low:o");
    return text.find("1 publisher matched") != std::string::npos ||
           text.find("2 publishers matched") != std::string::npos;
  });
}

// One that waits for a lock still says, once a second, how things stood.
TEST_F(Iceoryx, ARouDiThatSomebodyWhoHasDiedKeepsFromReadingIsTold) {
  std::optional<Roudi> roudi(directory_);
  Spoken gate = gateway(directory_, in("low", "/Low:o") + out("/Base:i", "base"));
  wait_for_description("/Low:o", "no publisher matched");
  Spoken lock({ARBITER_TESTS "/plain_iceoryx_lock", "Test", "One", "low"});
  ASSERT_EQ(lock.process.wait(), 0);
  wait_for_description("/Low:o", "RouDi does not answer");
  wait_until([&] {
    return described_input("/Base:i").find("RouDi does not answer") != std::string::npos;
  });
  roudi->process.kill();
  ASSERT_TRUE(gate.hear("RouDi has gone; the gateway begins anew")) << gate.heard;
  roudi.emplace(directory_);
  expect_that_samples_pass();
}

// It notices that its ends are dead when it touches them, or after ten seconds without a word.
TEST_F(Iceoryx, AGatewayThatRouDiHasGivenUpBeginsAnew) {
  const Roudi roudi(directory_);
  Spoken gate = gateway(directory_, in("low", "/Low:o") + out("/Base:i", "base"));
  wait_for_description("/Low:o", "no publisher matched");
  const pid_t worker = worker_of("/Low:o");
  Spoken leave(
      {ARBITER_TESTS "/plain_iceoryx_leave", "arbiter-gateway-iceoryx-" + std::to_string(worker)});
  ASSERT_EQ(leave.process.wait(), 0);
  wait_for_another_worker("/Low:o", worker);
  expect_that_samples_pass();
}

// One that only receives touches none of its ends.
TEST_F(Iceoryx, AGatewayThatRouDiHasGivenUpAndThatPublishesNothingBeginsAnew) {
  const Roudi roudi(directory_);
  Spoken gate = gateway(directory_, in("low", "/Low:o"));
  wait_for_description("/Low:o", "no publisher matched");
  const pid_t worker = worker_of("/Low:o");
  Spoken leave(
      {ARBITER_TESTS "/plain_iceoryx_leave", "arbiter-gateway-iceoryx-" + std::to_string(worker)});
  ASSERT_EQ(leave.process.wait(), 0);
  ASSERT_TRUE(gate.hear("RouDi runs but is silent: it has given the gateway up")) << gate.heard;
  wait_for_another_worker("/Low:o", worker);
  wait_for_description("/Low:o", "no publisher matched");
}

TEST_F(Iceoryx, AGatewayIsEndedWhetherRouDiRunsOrNot) {
  Spoken without = gateway(directory_, in("low", "/Low:o"));
  ASSERT_TRUE(without.hear("RouDi does not run"));
  without.process.signal(SIGTERM);
  EXPECT_EQ(without.process.wait(), 0);
  Roudi roudi(directory_);
  Spoken with = gateway(directory_, in("low", "/Low:o"));
  wait_for_description("/Low:o", "no publisher matched");
  with.process.signal(SIGTERM);
  EXPECT_EQ(with.process.wait(), 0);
  EXPECT_FALSE(daemon_.source("/Low:o")["open"]);
}

// Neither is said in place of the other.
TEST_F(Iceoryx, ARouDiThatHangsIsToldBesideAStranger) {
  const Roudi roudi(directory_);
  Spoken gate = gateway(directory_, in("low", "/Low:o") + out("/Base:i", "base"));
  wait_for_description("/Low:o", "no publisher matched");
  const Spoken stranger = plain_publisher("base");
  const std::string name = "plain-publisher-" + std::to_string(stranger.process.pid());
  wait_until([&] { return described_input("/Base:i").find(name) != std::string::npos; });
  roudi.process.stop();
  wait_until([&] {
    return described_input("/Base:i").find("RouDi does not answer; others publish there too") !=
           std::string::npos;
  });
  EXPECT_THAT(described_input("/Base:i"), HasSubstr(name));
  roudi.process.resume();
}

}  // namespace
}  // namespace arbiter::test
