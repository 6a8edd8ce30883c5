// arbiter pub and deactivate beside other hosts: who takes what is published by hand.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <string>
#include <vector>

#include "tests/link/known_hosts.hpp"
#include "tests/link/robot.hpp"

namespace arbiter::test {
namespace {

using testing::HasSubstr;
using testing::Not;

using PublishingByHand = LoopbackHosts;

// One sample is enough, however soon the program ends: it waits for the links.
TEST_F(PublishingByHand, IsToldWhoTakesItElsewhere) {
  Host head("head", runtime_, source_model("forever"), network());
  Host base("base", runtime_, motor_model("forever"), network());
  Body body(base);
  const Type type = type_of<Speed>();
  const std::vector<std::string> pub{"pub",
                                     kPlanner,
                                     "--count",
                                     "1",
                                     "--strict",
                                     "--type",
                                     type.name() + ":" + std::to_string(type.size()) + ":8"};
  await_host("head", "base");
  await([&] {  // on a busy machine the other host may not answer in time
    const ProgramResult told = run_arbiter("head", pub);
    return told.exit_code == 0 &&
           told.err.find(
               "samples cross to /Motor/speed:i of host base; what is delivered there is "
               "not counted here") != std::string::npos;
  });
  await([&] { return body.motor().take().has_value(); });
  await([&] {
    return run_arbiter("head", {"deactivate", kPlanner}).out.find("each host keeps its own") !=
           std::string::npos;
  });
}

TEST_F(PublishingByHand, IsToldWhoseRulesReadIt) {
  Host head("head", runtime_, kNoRules, network());
  Host base("base", runtime_,
            "<behaviors timeout='forever'><behavior name='Drive'><config at='/Motor/speed:i'>"
            "/Joystick/speed:o</config><condition>not /Planner/speed:o</condition></behavior>"
            "</behaviors>",
            network());
  await_host("head", "base");
  await([&] {
    const ProgramResult told = run_arbiter("head", {"pub", kPlanner, "--count", "1", "--strict"});
    return told.exit_code == 0 &&
           told.err.find("The rules of host base read /Planner/speed:o") != std::string::npos;
  });
  await([&] { return base.daemon().source(kPlanner)["active"] == true; });
}

// A host that has the source open itself obeys its own.
TEST_F(PublishingByHand, IsToldOfAHostThatObeysItsOwn) {
  Host head("head", runtime_, kNoRules, network());
  Host base("base", runtime_, motor_model("1s"), network());
  Body body(base);
  const Planner own(base);
  await_host("head", "base");
  await([&] { return base.daemon().source(kPlanner)["open"] == true; });
  const ProgramResult told = run_arbiter("head", {"pub", kPlanner, "--count", "1", "--strict"});
  EXPECT_EQ(told.exit_code, 1);
  EXPECT_THAT(told.err, Not(HasSubstr("cross")));
  await([&] {  // on a busy machine the other host may not answer in time
    return run_arbiter("head", {"pub", kPlanner, "--count", "1"})
               .err.find(
                   "/Motor/speed:i of host base obeys the /Planner/speed:o of its own host") !=
           std::string::npos;
  });
}

// What is published by hand may be urgent.
TEST_F(PublishingByHand, WaitsForNoHostThatIsSilent) {
  Host head("head", runtime_, kNoRules, network());
  Host base("base", runtime_, motor_model("1s"), network());
  Body body(base);
  await_host("head", "base");
  base.link().stop();
  const ProgramResult told = run_arbiter("head", {"pub", kPlanner, "--count", "1"});
  base.link().resume();
  EXPECT_EQ(told.exit_code, 0);
  EXPECT_THAT(told.err, Not(HasSubstr("cross")));
}

}  // namespace
}  // namespace arbiter::test
