// Samples of strangers, through the gateway and Arbiter, to other strangers.
#include <gtest/gtest.h>

#include "tests/gateway/dds/scene.hpp"

namespace arbiter::test {
namespace {

struct Vendors {
  const char* from;
  const char* to;
};

// Without it tests would be named by addresses.
void PrintTo(const Vendors& vendors, std::ostream* out) {
  *out << vendors.from << " to " << vendors.to;
}

class DdsPassing : public ::testing::TestWithParam<Vendors> {};

INSTANTIATE_TEST_SUITE_P(Vendors, DdsPassing,
                         ::testing::Values(Vendors{"cyclone", "cyclone"},
                                           Vendors{"cyclone", "fast"}, Vendors{"fast", "cyclone"},
                                           Vendors{"fast", "fast"}),
                         [](const auto& each) {
                           return std::string(each.param.from) + "_to_" + each.param.to;
                         });

TEST_P(DdsPassing, ATwistOfRos2PassesWithAllItsNumbers) {
  const OwnDomain domain;
  const Daemon daemon(base_model("1000s"));
  const DdsGateway gateway(daemon, domain, kNavIn + kBaseOut + "/>");
  Stranger base(GetParam().to, domain, {"sub", "twist", "rt/cmd_vel"});
  Stranger navigation(GetParam().from, domain, {"pub", "twist", "rt/cmd_vel_nav"});
  base.await("matched 1");
  navigation.await("matched 1");
  gateway.see("1 publisher matched");
  navigation.publish("0.25 -1.5");
  base.await("sample 0.25 -1.5");
  navigation.publish("0.5 0.125");
  base.await("sample 0.5 0.125");
}

TEST_P(DdsPassing, TheOneWhoOverridesIsObeyed) {
  const OwnDomain domain;
  const Daemon daemon(base_model("1000s"));
  const DdsGateway gateway(daemon, domain, kNavIn + kTeleopIn + kBaseOut + "/>");
  Stranger base(GetParam().to, domain, {"sub", "twist", "rt/cmd_vel"});
  Stranger navigation(GetParam().from, domain, {"pub", "twist", "rt/cmd_vel_nav"});
  Stranger teleop(GetParam().from, domain, {"pub", "twist", "rt/cmd_vel_teleop"});
  base.await("matched 1");
  navigation.await("matched 1");
  teleop.await("matched 1");
  gateway.see("/Nav/cmd_vel:o comes from DDS topic rt/cmd_vel_nav, 1 publisher matched");
  gateway.see("/Teleop/cmd_vel:o comes from DDS topic rt/cmd_vel_teleop, 1 publisher matched");
  navigation.publish("1 1");
  EXPECT_EQ(base.next_line(), "sample 1 1");
  teleop.publish("2 2");
  EXPECT_EQ(base.next_line(), "sample 2 2");
  navigation.publish("1 1");  // loses
  EXPECT_EQ(navigation.end(), 0);
  teleop.publish("3 3");
  EXPECT_EQ(base.next_line(), "sample 3 3");
}

// One source, one port.
std::string model_of(const std::string& source, const std::string& port) {
  return "<behaviors timeout=\"1000s\"><behavior name=\"Show\"><config at=\"" + port + "\">" +
         source + "</config></behavior></behaviors>";
}

// Larger than a datagram: it arrives in fragments, which are put together in Arbiter's memory.
TEST_P(DdsPassing, ALargeSamplePassesWhole) {
  const OwnDomain domain;
  const Daemon daemon(model_of("/Camera/blob:o", "/Screen/blob:i"));
  const DdsGateway gateway(
      daemon, domain,
      R"(<in topic="blobs" type="strangers::Blob" port="/Camera/blob:o" max_size="2MiB"/>)"
      R"(<out topic="passed" type="strangers::Blob" port="/Screen/blob:i" max_size="2MiB"/>)");
  Stranger camera(GetParam().from, domain, {"pub", "blob", "blobs"});
  Stranger screen(GetParam().to, domain, {"sub", "blob", "passed"});
  camera.await("matched 1");
  screen.await("matched 1");
  gateway.see("1 publisher matched");
  publish_until_heard(camera, screen, "6 200000");
  for (const char* const blob : {"7 1000000", "8 3", "9 70001"}) {
    camera.publish(blob);
    EXPECT_EQ(screen.next_line(), std::string("sample ") + blob);
  }
}

// Without keyed="true" in the mapping: whoever is there says that the type has a key.
TEST_P(DdsPassing, ATypeWithAKeyPassesThoughTheMappingDoesNotSayThatItHasOne) {
  const OwnDomain domain;
  const Daemon daemon(model_of("/Fleet/robot:o", "/Screen/robot:i"));
  const DdsGateway gateway(
      daemon, domain,
      R"(<in topic="robots" type="strangers::Robot" port="/Fleet/robot:o"/>)"
      R"(<out topic="shown" type="strangers::Robot" port="/Screen/robot:i"/>)");
  Stranger robot(GetParam().from, domain, {"pub", "robot", "robots"});
  Stranger screen(GetParam().to, domain, {"sub", "robot", "shown"});
  robot.await("matched 1");
  screen.await("matched 1");
  gateway.see("1 publisher matched");
  robot.publish("1 0.5");
  EXPECT_EQ(screen.next_line(), "sample 1 0.5");
  robot.publish("2 0.25");
  EXPECT_EQ(screen.next_line(), "sample 2 0.25");
}

// The next one is passed on as if it had not been.
TEST_P(DdsPassing, WhatDoesNotFitIsCountedAndPassedOver) {
  const OwnDomain domain;
  Daemon daemon(model_of("/Camera/blob:o", "/Screen/blob:i"));
  const DdsGateway gateway(
      daemon, domain,
      R"(<in topic="blobs" type="strangers::Blob" port="/Camera/blob:o" max_size="1KiB"/>)"
      R"(<out topic="passed" type="strangers::Blob" port="/Screen/blob:i" max_size="2MiB"/>)");
  Stranger camera(GetParam().from, domain, {"pub", "blob", "blobs"});
  Stranger screen(GetParam().to, domain, {"sub", "blob", "passed"});
  camera.await("matched 1");
  screen.await("matched 1");
  gateway.see("1 publisher matched");
  publish_until_heard(camera, screen, "0 3");
  camera.publish("1 5000");
  camera.publish("2 8000");
  camera.publish("3 100");
  EXPECT_EQ(screen.next_line(), "sample 3 100");
  await_described(daemon, "/Camera/blob:o", "2 of a size that does not fit");
}

}  // namespace
}  // namespace arbiter::test
