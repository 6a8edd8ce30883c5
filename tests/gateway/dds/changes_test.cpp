// A gateway of DDS that runs while its policy and its mapping change.
#include <gmock/gmock.h>
#include <sys/stat.h>

#include "tests/gateway/dds/scene.hpp"
#include "tests/support/other_user.hpp"
#include "tests/support/temporary_directory.hpp"

namespace arbiter::test {
namespace {

using testing::HasSubstr;
using testing::Not;

const std::string kEntries = kNavIn + kTeleopIn + kBaseOut + R"( idle="zero"/>)";

TEST(DdsOfAnotherUser, WhatThePolicyForbidsIsLeftOutUntilItAllowsIt) {
  if (!may_be_another_user()) GTEST_SKIP() << "only root can start processes of other users";
  const TemporaryDirectory files;
  const std::string policy = files.write("policy",
                                         "deny user nobody output /Teleop/*\nallow user nobody "
                                         "output,input *\nallow user nobody observe\n");
  const OwnDomain domain;
  Daemon daemon(base_model("60s"), {.arguments = {"--policy", policy}});
  ASSERT_EQ(::chmod(daemon.directory().c_str(), 0711), 0);
  const DdsGateway gateway(
      daemon, domain, kEntries, "lo", "",
      {"/usr/bin/setpriv", "--reuid=65534", "--regid=65534", "--clear-groups"});
  gateway.see(
      "/Teleop/cmd_vel:o is not served: user nobody (65534) may not open the output port "
      "/Teleop/cmd_vel:o: " +
      policy +
      ":1 says: deny user nobody output /Teleop/*; trying "
      "again");
  Stranger base("cyclone", domain, {"sub", "twist", "rt/cmd_vel"});
  const Stranger navigation("cyclone", domain, {"pub", "twist", "rt/cmd_vel_nav"});
  const Stranger teleop("cyclone", domain, {"pub", "twist", "rt/cmd_vel_teleop"});
  publish_until_heard(navigation, base, "1 0");
  EXPECT_EQ(daemon.status()["refusals"][0]["output"], "/Teleop/cmd_vel:o");
  files.write("policy", "allow user nobody output,input *\nallow user nobody observe\n");
  daemon.load(base_model("60s"));
  gateway.see("/Teleop/cmd_vel:o is served now");
  publish_until_heard(teleop, base, "2 0");
}

// T may be for ever, as the mapping wants it: nobody has told the gateway.
TEST(DdsOfAnotherUser, WhoMayNotObserveIsToldThatTIsNotKnown) {
  if (!may_be_another_user()) GTEST_SKIP() << "only root can start processes of other users";
  const TemporaryDirectory files;
  const std::string policy = files.write("policy", "allow user nobody output,input *\n");
  const OwnDomain domain;
  Daemon daemon(base_model("forever"), {.arguments = {"--policy", policy}});
  ASSERT_EQ(::chmod(daemon.directory().c_str(), 0711), 0);
  const std::string nav =
      R"(<in topic="/cmd_vel_nav" qos="latched" )" + kTwist + R"( port="/Nav/cmd_vel:o"/>)";
  const DdsGateway gateway(
      daemon, domain, nav, "lo", "",
      {"/usr/bin/setpriv", "--reuid=65534", "--regid=65534", "--clear-groups"});
  const std::string why = "samples published before are not taken, because T is not ";
  gateway.see(why + "known");
  files.write("policy", "allow user nobody output,input *\nallow user nobody observe\n");
  daemon.load(base_model("500ms"));
  gateway.see(why + "forever");
}

TEST(DdsMapping, AnotherInterfaceIsTakenUp) {
  const OwnDomain domain;
  Daemon daemon(base_model("60s"));
  DdsGateway gateway(daemon, domain, kEntries, "none0");
  gateway.see("trying again");
  await_described(daemon, "/Nav/cmd_vel:o", "DDS cannot be joined");
  gateway.write_mapping(kEntries);
  gateway.process().signal(SIGUSR1);
  Stranger base("cyclone", domain, {"sub", "twist", "rt/cmd_vel"});
  const Stranger navigation("cyclone", domain, {"pub", "twist", "rt/cmd_vel_nav"});
  publish_until_heard(navigation, base, "1 0");
}

TEST(DdsMapping, ABadOneChangesNothingAndSaysWhereItIsBad) {
  const OwnDomain domain;
  Daemon daemon(base_model("60s"));
  DdsGateway gateway(daemon, domain, kEntries);
  Stranger base("cyclone", domain, {"sub", "twist", "rt/cmd_vel"});
  const Stranger navigation("cyclone", domain, {"pub", "twist", "rt/cmd_vel_nav"});
  publish_until_heard(navigation, base, "1 0");
  gateway.write_mapping("<in topic='/cmd_vel_nav'/>");
  gateway.process().signal(SIGUSR1);
  gateway.see("gateway.xml:2:1: error: ");
  gateway.see("the mapping was not read again: the one before stays");
  publish_until_heard(navigation, base, "2 0");
  gateway.write_mapping(kNavIn);
  gateway.process().signal(SIGUSR1);
  gateway.see("the mapping was read again");
  base.await("matched 0");
  EXPECT_EQ(gateway.end(), 0);
}

// A service whose unit has WatchdogSec= is killed if it does not.
TEST(DdsProgram, TellsTheServiceManagerThatItRuns) {
  const OwnDomain domain;
  const TemporaryDirectory files;
  const Daemon daemon(base_model("60s"));
  NotifySocket manager(files.file("manager"));
  const std::string mapping =
      files.write("gateway.xml", "<gateway kind='dds' domain='" + std::to_string(domain.number()) +
                                     "' interface='lo'>" + kNavIn + "</gateway>");
  ChildProcess gateway({ARBITER_PROGRAMS "/arbiter-gateway-dds", mapping},
                       {{"NOTIFY_SOCKET", manager.path()}, {"WATCHDOG_USEC", "5000000"}}, {});
  EXPECT_TRUE(manager.wait_for("READY=1", gateway));
  for (int i = 0; i < 3; ++i) EXPECT_TRUE(manager.wait_for("WATCHDOG=1", gateway));
  gateway.signal(SIGTERM);
  EXPECT_EQ(gateway.wait(), 0);
}

}  // namespace
}  // namespace arbiter::test
