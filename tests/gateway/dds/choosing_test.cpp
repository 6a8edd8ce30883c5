// Topics whose samples choose between two sources: Booleans, and numbers beside a threshold.
#include <gtest/gtest.h>

#include "tests/gateway/dds/scene.hpp"
#include "tests/support/await.hpp"

namespace arbiter::test {
namespace {

class DdsChoosing : public ::testing::TestWithParam<const char*> {};

INSTANTIATE_TEST_SUITE_P(Vendors, DdsChoosing, ::testing::Values("cyclone", "fast"),
                         [](const auto& each) { return std::string(each.param); });

// Navigation moves the base while the emergency stop says that it is released.
const std::string kLocked = R"(<behaviors timeout="1000s">
  <behavior name="Navigate"><config at="/Base/cmd_vel:i">/Nav/cmd_vel:o</config>
    <condition>/EStop/released:o</condition></behavior>
</behaviors>
)";

TEST_P(DdsChoosing, ABooleanOfRos2IsALock) {
  const OwnDomain domain;
  const Daemon daemon(kLocked);
  const DdsGateway gateway(
      daemon, domain,
      R"(<in topic="/e_stop" type="std_msgs/msg/Bool" true="/EStop/pressed:o" )"
      R"(false="/EStop/released:o"/>)" +
          kNavIn + kBaseOut + R"( idle="zero"/>)");
  Stranger base(GetParam(), domain, {"sub", "twist", "rt/cmd_vel"});
  Stranger navigation(GetParam(), domain, {"pub", "twist", "rt/cmd_vel_nav"});
  Stranger button(GetParam(), domain, {"pub", "bool", "rt/e_stop"});
  base.await("matched 1");
  navigation.await("matched 1");
  button.await("matched 1");
  gateway.see("/Nav/cmd_vel:o comes from DDS topic rt/cmd_vel_nav, 1 publisher matched");
  gateway.see("comes from DDS topic rt/e_stop, 1 publisher matched");
  gateway.see("1 subscriber matched");
  button.publish("0");  // false: released
  for (std::optional<std::string> line; line != "sample 1 0"; line = base.line_within(20)) {
    navigation.publish("1 0");
  }
  button.publish("1");  // true: pressed
  base.await("sample 0 0");
  for (int i = 0; i < 5; ++i) {
    navigation.publish("1 0");
    EXPECT_EQ(base.next_line(), "sample 0 0");
  }
  button.publish("0");
  for (std::optional<std::string> line; line != "sample 2 0"; line = base.line_within(20)) {
    navigation.publish("2 0");
  }
}

// Robot.battery is a double behind an int and its padding.
TEST_P(DdsChoosing, ABatteryChoosesBetweenTwoSources) {
  const OwnDomain domain;
  Daemon daemon(
      "<behaviors timeout=\"1000s\"><source port=\"/Battery/full:o\"/>"
      "<source port=\"/Battery/low:o\"/></behaviors>");
  const DdsGateway gateway(daemon, domain,
                           R"(<in topic="robots" type="strangers::Robot" above="/Battery/full:o" )"
                           R"(below="/Battery/low:o" threshold="0.2" field="f64" offset="8"/>)");
  Stranger robot(GetParam(), domain, {"pub", "robot", "robots"});
  robot.await("matched 1");
  gateway.see("1 publisher matched");
  const auto arrivals = [&](const std::string& source) {
    const auto status = daemon.source(source);
    return status.is_null() ? 0 : status.value("published", 0);
  };
  robot.publish("1 0.5");
  await([&] { return arrivals("/Battery/full:o") == 1; });
  EXPECT_EQ(arrivals("/Battery/low:o"), 0);
  robot.publish("1 0.1");
  await([&] { return arrivals("/Battery/low:o") == 1; });
  EXPECT_EQ(arrivals("/Battery/full:o"), 1);
  EXPECT_FALSE(daemon.source("/Battery/full:o").value("active", true));
}

}  // namespace
}  // namespace arbiter::test
