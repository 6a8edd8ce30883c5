// A gateway's loop: how things stand, by which T, and how it takes leave.
#include <gmock/gmock.h>

#include <atomic>
#include <string>
#include <vector>

#include <arbiter/arbiter.hpp>

#include "tests/gateway/bridge_scene.hpp"
#include "tests/support/daemon.hpp"

namespace arbiter::gateway {
namespace {

TEST(Bridging, WhatKeepsATopicFromWorkingIsTroubleInTheStatus) {
  test::Daemon daemon{kDriving};
  Running gateway;
  await([&] { return gateway.middleware.serves("/Nav/cmd:o") && gateway.middleware.outs() == 1; });
  const auto is_trouble = [&](const char* source) {
    const auto status = daemon.source(source);
    return status.contains("described") && status["trouble"] == true;
  };
  gateway.middleware.account("/Nav/cmd:o").set_obstacle("its QoS does not match");
  await([&] { return is_trouble("/Nav/cmd:o"); });
  EXPECT_FALSE(is_trouble("/Joy/cmd:o"));
  gateway.middleware.account("/Nav/cmd:o").set_obstacle("");
  await([&] { return !is_trouble("/Nav/cmd:o"); });
  gateway.middleware.account("/Base/cmd:i").set_obstacle("its QoS does not match");
  await([&] { return daemon.input("/Base/cmd:i")["trouble"] == true; });
}

// What a topic that keeps samples brings may be an arrival only where T is for ever.
// The loop sends the first one, and each that comes while it has its turn.
TEST(Bridging, TheThreadThatDeliversASampleSendsIt) {
  const test::Daemon daemon(kDriving);
  Running gateway;
  await([&] { return gateway.middleware.serves("/Nav/cmd:o"); });
  await([&] {
    gateway.middleware.deliver("/Nav/cmd:o", "go");
    return gateway.middleware.has_sent_here();
  });
}

TEST(Bridging, TheMiddlewareLooksWithTheTOfTheModelInForce) {
  const auto model = [](bool is_forever) {
    return std::string("<behaviors timeout='") + (is_forever ? "forever" : "60s") +
           "'><behavior name='Drive'><config at='/Base/cmd:i'>/Nav/cmd:o</config></behavior>"
           "</behaviors>";
  };
  constexpr int kLoads = 12;  // some of them right before the loop asks for T anyway
  test::Daemon daemon{model(true)};
  std::atomic<const Incoming*> nav{nullptr};
  std::atomic<int> loads{0};
  std::atomic<int> wrong{0};
  Running gateway("gateway", kEntries, [&] {
    const Incoming* const in = nav;
    if (in == nullptr || loads == kLoads) return;
    if (in->max_age().is_forever() != (loads % 2 == 0)) ++wrong;
    daemon.load(model((loads + 1) % 2 == 0));
    ++loads;
  });
  await([&] { return gateway.middleware.serves("/Nav/cmd:o"); });
  nav = gateway.middleware.in("/Nav/cmd:o");
  await([&] { return loads == kLoads; });
  EXPECT_EQ(wrong, 0);
}

// Nobody else tells the robot, where no service manager does; and its last command would stay.
TEST(Ending, SaysStopWhoeverCommandsAndNothingBehindIt) {
  test::Daemon daemon{kDriving};
  Running gateway;
  await([&] { return gateway.middleware.serves("/Nav/cmd:o") && gateway.middleware.outs() == 1; });
  const auto is_driving = [&] {
    return !gateway.middleware.sent().empty() && gateway.middleware.sent().back() == "drive";
  };
  gateway.middleware.deliver("/Nav/cmd:o", "drive");
  await(is_driving);
  std::vector<std::string> sent;
  gateway.middleware.at_stop = [&] {  // until then a middleware's threads deliver
    gateway.middleware.deliver("/Nav/cmd:o", "drive");
    sent = gateway.middleware.sent();
  };
  gateway.end();
  // The network may lose one.
  ASSERT_GE(sent.size(), 4u);
  EXPECT_THAT(std::vector(sent.end() - 4, sent.end()),
              testing::ElementsAre("drive", kZeros, kZeros, kZeros));
}

// Where another gateway serves the entry, a stop would be a command of its own.
TEST(Ending, SaysNothingWhereSomebodyElseHasThePort) {
  test::Daemon daemon{kDriving};
  Node node("other");
  const auto taken = node.input_port("/Base/cmd:i");
  Running gateway;
  await([&] { return gateway.middleware.serves("/Nav/cmd:o"); });
  gateway.end();
  EXPECT_THAT(gateway.middleware.sent(), testing::IsEmpty());
}

}  // namespace
}  // namespace arbiter::gateway
