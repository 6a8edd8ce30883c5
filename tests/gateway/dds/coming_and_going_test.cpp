// Strangers that come late, go, and are killed; a gateway that is stopped or killed.
#include <gtest/gtest.h>

#include <string>

#include <arbiter/arbiter.hpp>

#include "tests/gateway/dds/scene.hpp"
#include "tests/support/await.hpp"

namespace arbiter::test {
namespace {

// Runs what a service manager runs after a gateway that has died, until the robot has heard it: on
// a busy machine its second may end before the two have found each other.
void stop_afterwards(DdsGateway& gateway, Stranger& base) {
  base.lines_so_far();  // what was said before does not count
  for (bool has_stopped = false; !has_stopped;) {
    EXPECT_EQ(gateway.send_idle(), 0);
    for (const std::string& line : base.lines_so_far()) {
      has_stopped = has_stopped || line == "sample 0 0";
    }
  }
}

class DdsComingAndGoing : public ::testing::TestWithParam<const char*> {};

INSTANTIATE_TEST_SUITE_P(Vendors, DdsComingAndGoing, ::testing::Values("cyclone", "fast"),
                         [](const auto& each) { return std::string(each.param); });

TEST_P(DdsComingAndGoing, ASubscriberIsToldToStopWhileNobodyCommands) {
  const OwnDomain domain;
  const Daemon daemon(base_model("200ms"));
  const DdsGateway gateway(daemon, domain, kNavIn + kBaseOut + R"( idle="zero"/>)");
  Stranger base(GetParam(), domain, {"sub", "twist", "rt/cmd_vel"});
  base.await("matched 1");
  EXPECT_EQ(base.next_line(), "sample 0 0");  // it has come while nobody commands
  EXPECT_EQ(base.next_line(), "sample 0 0");  // and again, should one get lost
}

TEST_P(DdsComingAndGoing, ARobotStopsWhenItsCommanderIsKilledAndObeysTheNextOne) {
  Drive drive("200ms", GetParam(), GetParam());
  auto& [domain, daemon, gateway, base, navigation] = static_cast<Passage&>(drive);
  publish_until_heard(navigation, base, "1 0");
  navigation.process().kill();
  base.await("sample 0 0");
  Stranger next(GetParam(), domain, {"pub", "twist", "rt/cmd_vel_nav"});
  next.await("matched 1");
  publish_until_heard(next, base, "2 0");
  EXPECT_EQ(next.end(), 0);
  base.await("sample 0 0");
}

TEST_P(DdsComingAndGoing, ASubscriberThatIsKilledHoldsNobodyUp) {
  Drive drive("1000s", GetParam(), GetParam(), "");
  auto& [domain, daemon, gateway, base, navigation] = static_cast<Passage&>(drive);
  Stranger other(GetParam(), domain, {"sub", "twist", "rt/cmd_vel"});
  other.await("matched 1");
  gateway.see("2 subscribers matched");
  navigation.publish("1 0");
  EXPECT_EQ(other.next_line(), "sample 1 0");
  base.process().kill();
  for (int i = 2; i < 200; ++i) {
    const std::string numbers = std::to_string(i) + " 0";
    navigation.publish(numbers);
    EXPECT_EQ(other.next_line(), "sample " + numbers);
  }
}

TEST_P(DdsComingAndGoing, AGatewayThatIsKilledIsSilenceAndTheNextOneGoesOn) {
  Drive drive("200ms", GetParam(), GetParam());
  auto& [domain, daemon, gateway, base, navigation] = static_cast<Passage&>(drive);
  publish_until_heard(navigation, base, "1 0");
  gateway.process().kill();
  gateway.start();
  navigation.await("matched 2");
  base.await("matched 2");
  publish_until_heard(navigation, base, "2 0");
}

// Without a service manager nobody else would tell the robot.
TEST_P(DdsComingAndGoing, AGatewayThatBeginsAnewOrEndsStopsTheRobotThatItDrove) {
  Drive drive("1000s", GetParam(), GetParam());
  auto& [domain, daemon, gateway, base, navigation] = static_cast<Passage&>(drive);
  publish_until_heard(navigation, base, "1 0");
  gateway.process().signal(SIGUSR1);
  base.await("sample 0 0");
  publish_until_heard(navigation, base, "2 0");
  EXPECT_EQ(gateway.end(), 0);
  base.await("sample 0 0");
}

// The components that were open stay with each other; what is started again meets the gateway.
TEST_P(DdsComingAndGoing, ADaemonThatKnowsNobodyLetsTheGatewayInAgain) {
  Drive drive("1000s", GetParam(), GetParam());
  auto& [domain, daemon, gateway, base, navigation] = static_cast<Passage&>(drive);
  publish_until_heard(navigation, base, "1 0");
  daemon.terminate();
  daemon.lose_state();
  daemon.restart();
  base.await("sample 0 0");
  gateway.see("the state of the last daemon is lost; the gateway begins anew");
  publish_until_heard(navigation, base, "2 0");
  await_described(daemon, "/Nav/cmd_vel:o", "1 publisher matched");
  EXPECT_EQ(daemon.input("/Base/cmd_vel:i")["component"]["node"], "arbiter-gateway-dds");
}

// ExecStopPost= of its unit. Not even a daemon is needed.
TEST_P(DdsComingAndGoing, ForAGatewayThatIsKilledTheRobotIsStoppedByAnother) {
  Drive drive("1000s", GetParam(), GetParam());
  auto& [domain, daemon, gateway, base, navigation] = static_cast<Passage&>(drive);
  publish_until_heard(navigation, base, "1 0");
  gateway.process().kill();
  stop_afterwards(gateway, base);
  EXPECT_NE(gateway.log().find("DDS topic rt/cmd_vel, 1 subscriber matched"), std::string::npos);
  base.process().kill();
  const std::string nobody = "nobody was there to hear it: no subscriber of DDS topic rt/cmd_vel\n";
  while (!gateway.log().ends_with(nobody)) EXPECT_EQ(gateway.send_idle(), 0);
}

// Nobody can be sure that a mapping which is being edited is good at that moment.
TEST_P(DdsComingAndGoing, AMistakeInTheMappingKeepsNobodyFromStoppingTheRobot) {
  Drive drive("1000s", GetParam(), GetParam());
  auto& [domain, daemon, gateway, base, navigation] = static_cast<Passage&>(drive);
  publish_until_heard(navigation, base, "1 0");
  gateway.write_mapping("<in topic='/cmd_vel_nav'/>");
  gateway.process().signal(SIGUSR1);
  gateway.see("the one before stays");
  gateway.process().kill();
  stop_afterwards(gateway, base);
}

// Cyclone's own configuration belongs to the mapping, and to the copy of it.
TEST_P(DdsComingAndGoing, NorDoesOneInTheConfigurationOfCyclone) {
  Drive drive("1000s", GetParam(), GetParam());
  auto& [domain, daemon, gateway, base, navigation] = static_cast<Passage&>(drive);
  const std::string configuration = daemon.directory() + "/cyclonedds.xml";
  std::ofstream(configuration) << "<CycloneDDS/>";
  gateway.write_mapping(kNavIn + kBaseOut + R"( idle="zero"/>)", "lo",
                        "configuration=\"cyclonedds.xml\"");
  gateway.process().signal(SIGUSR1);
  gateway.see("the mapping was read again");
  publish_until_heard(navigation, base, "1 0");
  std::ofstream(configuration) << "<CycloneDDS><Domain>";
  gateway.process().signal(SIGUSR1);
  gateway.see("cyclonedds.xml:1:");
  gateway.see("the one before stays");
  publish_until_heard(navigation, base, "2 0");
  gateway.process().kill();
  stop_afterwards(gateway, base);
}

// Nor is a copy that is none believed.
TEST_P(DdsComingAndGoing, ABadCopyOfTheMappingIsPassedOver) {
  Drive drive("1000s", GetParam(), GetParam());
  auto& [domain, daemon, gateway, base, navigation] = static_cast<Passage&>(drive);
  publish_until_heard(navigation, base, "1 0");
  gateway.process().kill();
  const std::string of_another_file = std::string("a") + '\0' + "10" + '\0' + "<gateway/>" + '\0';
  for (const std::string& copy : {std::string("mapping"), of_another_file}) {
    std::ofstream(gateway.copy(), std::ios::trunc) << copy;
    stop_afterwards(gateway, base);
    gateway.see("no copy of the mapping is good");
  }
}

// What waited for it meanwhile is older than T: it must not move the robot.
TEST_P(DdsComingAndGoing, WhatWaitedWhileTheGatewayWasStoppedIsNotObeyed) {
  Drive drive("200ms", GetParam(), GetParam());
  auto& [domain, daemon, gateway, base, navigation] = static_cast<Passage&>(drive);
  publish_until_heard(navigation, base, "1 0");
  gateway.process().stop();
  navigation.publish("13 0");
  ::poll(nullptr, 0, 1000);  // what is tested: that time passes while it is stopped
  gateway.process().resume();
  // It has subscribed again: to a new subscriber a reliable publisher repeats nothing. Fast DDS
  // knows the old one, too, until the time has passed in which that must show that it lives.
  navigation.await(GetParam() == std::string("fast") ? "matched 2" : "matched 1");
  // From now on it passes on what is fresh.
  for (std::optional<std::string> line; line != "sample 2 0"; line = base.line_within(20)) {
    ASSERT_NE(line, "sample 13 0");
    navigation.publish("2 0");
  }
}

// A lock that is published once, and kept for who comes later. It was pressed before there was a
// gateway.
struct LatchedLock {
  // `timeout`: T of both of its sources.
  LatchedLock(const std::string& timeout, const std::string& vendor)
      : daemon(model(timeout)),
        lock(vendor, domain, {"pub", "bool", "rt/lock", "durability=transient_local"}),
        witness(vendor, domain, {"sub", "bool", "rt/lock"}) {
    lock.await("matched 1");
    witness.await("matched 1");
    publish_until_heard(lock, witness, "1 0");
  }
  static std::string model(const std::string& timeout) {
    return "<behaviors timeout=\"" + timeout +
           "\"><source port=\"/Lock/pressed:o\"/><source port=\"/Lock/released:o\"/></behaviors>";
  }
  int published(const std::string& source) {
    const auto status = daemon.source(source);
    return status.is_null() ? 0 : status.value("published", 0);
  }
  void release_until_heard() {
    while (published("/Lock/released:o") == 0) {
      lock.publish("0");
      ::poll(nullptr, 0, 5);
    }
  }

  OwnDomain domain;
  Daemon daemon;
  Stranger lock;
  Stranger witness;
};

const std::string kLatchedLock = R"(<in topic="/lock" type="std_msgs/msg/Bool" qos="latched" )"
                                 R"(true="/Lock/pressed:o" false="/Lock/released:o"/>)";

TEST_P(DdsComingAndGoing, ALatchedSampleFromBeforeTheGatewayCameHoldsWhereTIsForever) {
  LatchedLock latched("forever", GetParam());
  const DdsGateway gateway(latched.daemon, latched.domain, kLatchedLock);
  await([&] { return latched.published("/Lock/pressed:o") != 0; });
  EXPECT_TRUE(latched.daemon.source("/Lock/pressed:o").value("active", false));
  // Once the model says that it ends, what was before is not taken again.
  latched.daemon.load(LatchedLock::model("500ms"));
  gateway.see("samples published before are not taken, because T is not forever");
  const int before = latched.published("/Lock/pressed:o");
  latched.lock.await("matched 2");
  latched.release_until_heard();
  EXPECT_EQ(latched.published("/Lock/pressed:o"), before);
}

TEST_P(DdsComingAndGoing, ALatchedSampleFromBeforeTheGatewayCameIsNoArrivalWhereTEnds) {
  LatchedLock latched("1000s", GetParam());
  const DdsGateway gateway(latched.daemon, latched.domain, kLatchedLock);
  latched.lock.await("matched 2");
  gateway.see("1 publisher matched");
  latched.release_until_heard();
  EXPECT_EQ(latched.published("/Lock/pressed:o"), 0);
}

// It is asked for once the model says that what was before still holds.
TEST_P(DdsComingAndGoing, ALatchedSampleFromBeforeIsTakenOnceTIsForever) {
  LatchedLock latched("1000s", GetParam());
  const DdsGateway gateway(latched.daemon, latched.domain, kLatchedLock);
  gateway.see("samples published before are not taken, because T is not forever");
  latched.lock.await("matched 2");
  EXPECT_EQ(latched.published("/Lock/pressed:o"), 0);
  latched.daemon.load(LatchedLock::model("forever"));
  await([&] { return latched.published("/Lock/pressed:o") != 0; });
}

// A base that comes late to a topic that says what stays true, after the gateway has begun anew.
TEST_P(DdsComingAndGoing, ALatchedTopicHasItsLastSampleAlsoAfterTheGatewayHasBegunAnew) {
  Drive drive("1000s", GetParam(), GetParam(), R"( qos="latched")");
  auto& [domain, daemon, gateway, base, navigation] = static_cast<Passage&>(drive);
  publish_until_heard(navigation, base, "1 0");
  gateway.process().signal(SIGUSR1);
  const std::string serves = "serves 1 topic in, 1 out";
  while (gateway.log().find(serves) == gateway.log().rfind(serves)) ::poll(nullptr, 0, 1);
  Stranger late(GetParam(), domain, {"sub", "twist", "rt/cmd_vel", "durability=transient_local"});
  late.await("sample 1 0");
}

// Nor does it forget it when it learns that the type has a key.
TEST_P(DdsComingAndGoing, ALatchedTopicHasItsLastSampleAlsoForTheFirstWhoHasAKey) {
  const OwnDomain domain;
  Daemon daemon(
      R"(<behaviors><behavior name="Show"><config at="/To:i">/From:o</config></behavior></behaviors>)");
  const DdsGateway gateway(
      daemon, domain,
      R"(<out topic="robots" type="strangers::Robot" port="/To:i" qos="latched"/>)");
  Node node("fleet");
  auto robots = node.output_port("/From:o", Type::variable("strangers::Robot", 64));
  std::string bytes("\0\1\0\0\7", 5);
  bytes.resize(20);
  gateway.see("serves 0 topics in, 1 out");
  robots.publish(Bytes(reinterpret_cast<const std::byte*>(bytes.data()), bytes.size()));
  await_described(daemon, "/To:i", "the last sample has 20 bytes");
  Stranger late(GetParam(), domain, {"sub", "robot", "robots", "durability=transient_local"});
  late.await("sample 7 0");
}

}  // namespace
}  // namespace arbiter::test
