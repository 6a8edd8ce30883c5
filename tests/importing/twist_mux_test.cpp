#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/importing/imported.hpp"

namespace arbiter::test {
namespace {

using testing::AllOf;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;
using testing::Not;

Imported import_mux(const std::string& text, const importing::ImportOptions& options = {}) {
  return import_texts(Program::kTwistMux, {text}, options);
}

// In the form of ROS 1, where each entry is a line of its own.
std::string topics(const std::vector<std::string>& entries,
                   const std::vector<std::string>& locks = {}) {
  std::string text = "topics:\n";
  for (const auto& entry : entries) text += "- {" + entry + "}\n";
  if (!locks.empty()) text += "locks:\n";
  for (const auto& lock : locks) text += "- {" + lock + "}\n";
  return text;
}

const std::string kNavigation = "name: nav, topic: nav_vel, timeout: 0.5, priority: 10";
const std::string kJoystick = "name: joy, topic: joy_vel, timeout: 0.25, priority: 100";

TEST(TwistMux, AModelIsWrittenForPeople) {
  const auto imported = import_mux(
      topics({kNavigation, kJoystick}, {"name: e_stop, topic: e_stop, timeout: 0.3, priority: 255",
                                        "name: pause, topic: pause, timeout: 0.0, priority: 50"}));
  EXPECT_THAT(imported.findings(), ElementsAre("6:40 warning silent-lock"));
  ASSERT_TRUE(imported.plan);
  EXPECT_EQ(importing::write_model(*imported.plan), R"(<?xml version="1.0" encoding="UTF-8"?>
<!--
  What twist_mux decides, imported from a.yaml by `arbiter import twist_mux`.
-->
<behaviors>

  <define name="base"> /base/cmd_vel:i </define>

  <!-- A message counts until it is older than its timeout, not as old: hence the nanosecond. -->
  <source port="/joy/cmd_vel:o" timeout="250000001ns"/>
  <source port="/nav/cmd_vel:o" timeout="500000001ns"/>

  <!-- Locks. One with a heartbeat is free while `released` is active, so that silence locks; one
       without is free while `pressed` is not, so that silence leaves it as it is. -->
  <!-- /e_stop, priority 255, timeout 0.3 s: a.yaml:5 -->
  <source port="/e_stop/released:o" timeout="300000001ns"/>
  <!-- /pause, priority 50, no timeout: a.yaml:6 -->
  <source port="/pause/pressed:o" timeout="forever"/>

  <!-- /joy_vel, priority 100, timeout 0.25 s: a.yaml:3 -->
  <behavior name="joy">
    <config at="${base}">/joy/cmd_vel:o</config>
    <condition>/e_stop/released:o</condition>  <!-- e_stop, priority 255: a.yaml:5 -->
    <inhibition>nav</inhibition>
  </behavior>

  <!-- /nav_vel, priority 10, timeout 0.5 s: a.yaml:2 -->
  <behavior name="nav">
    <config at="${base}">/nav/cmd_vel:o</config>
    <condition>/e_stop/released:o</condition>  <!-- e_stop, priority 255: a.yaml:5 -->
    <condition>not /pause/pressed:o</condition>  <!-- pause, priority 50: a.yaml:6 -->
  </behavior>

</behaviors>
)");
  EXPECT_EQ(importing::write_mapping(*imported.plan, "model.xml"),
            R"(<?xml version="1.0" encoding="UTF-8"?>
<!--
  The topics of the model model.xml, imported from a.yaml by `arbiter import twist_mux`.

  Correct the topics if the launch file remaps them. Those of ROS 1 come and go through ros1_bridge.
-->
<gateway kind="dds">

  <!-- joy: a.yaml:3 -->
  <in topic="/joy_vel" type="geometry_msgs/msg/Twist" port="/joy/cmd_vel:o"/>
  <!-- nav: a.yaml:2 -->
  <in topic="/nav_vel" type="geometry_msgs/msg/Twist" port="/nav/cmd_vel:o"/>

  <!-- lock e_stop: a.yaml:5 -->
  <in topic="/e_stop" type="std_msgs/msg/Bool"
      false="/e_stop/released:o"/>
  <!-- lock pause: a.yaml:6 -->
  <!-- It is said once, and counts however late it comes: hence max_age, and no qos, so that a lost
       datagram is repeated. What is said while no gateway runs, or while it is stopped, may be
       lost. -->
  <in topic="/pause" type="std_msgs/msg/Bool"
      true="/pause/pressed:o" max_age="86400s"/>

  <out port="/base/cmd_vel:i" topic="/cmd_vel_out" type="geometry_msgs/msg/Twist" idle="zero"/>

</gateway>
)");
}

TEST(TwistMux, WhatIsDangerousIsReportedWithItsLine) {
  EXPECT_THAT(import_mux(topics({kNavigation, kJoystick})).findings(), IsEmpty());
  // A fallback without a timeout.
  auto imported = import_mux(topics({"name: a, topic: a, timeout: 0.0, priority: 1", kJoystick}));
  EXPECT_THAT(imported.findings(), ElementsAre("2:32 warning never-expires"));
  EXPECT_THAT(imported.message("never-expires"),
              AllOf(HasSubstr("its last command stays in force"), Not(HasSubstr("below"))));
  // The same above another one.
  imported = import_mux(topics({"name: a, topic: a, timeout: 0.0, priority: 99", kNavigation}));
  EXPECT_THAT(imported.findings(),
              ElementsAre("2:32 warning never-expires", "3:55 warning shut-out"));
  EXPECT_THAT(imported.message("never-expires"), HasSubstr("nothing below it ever gets through"));
  EXPECT_THAT(imported.message("shut-out"), HasSubstr("\"a\" (a.yaml:2:3) has no timeout"));
  EXPECT_THAT(imported.topics(), ElementsAre("/a"));
  EXPECT_THAT(
      importing::write_model(*imported.plan),
      HasSubstr("* the topic /nav_vel of nav, a.yaml:3: \"a\" (a.yaml:2:3) has no timeout"));

  imported = import_mux(topics({"name: a, topic: a, timeout: -2.0, priority: 1"}));
  EXPECT_THAT(imported.findings(),
              ElementsAre("2:32 warning negative-timeout", "2:32 warning never-expires"));
  imported = import_mux(topics({kJoystick, "name: a, topic: a, timeout: 0.5, priority: 0"}));
  EXPECT_THAT(imported.findings(), ElementsAre("3:47 warning priority-zero"));
  EXPECT_THAT(imported.topics(), ElementsAre("/joy_vel"));
  imported = import_mux(topics({kJoystick, "name: a, topic: a, timeout: 0.5, priority: -3"}));
  EXPECT_THAT(imported.findings(),
              ElementsAre("3:47 warning priority-clamped", "3:47 warning priority-zero"));
  imported = import_mux(topics({kJoystick, "name: a, topic: a, timeout: 0.5, priority: 300"}));
  EXPECT_THAT(imported.findings(), ElementsAre("3:47 warning priority-clamped"));
  EXPECT_THAT(imported.topics(), ElementsAre("/a", "/joy_vel"));
  imported = import_mux(topics({kJoystick, "name: a, topic: a, timeout: 0.5, priority: 100"}));
  EXPECT_THAT(imported.findings(), ElementsAre("3:47 warning equal-priorities"));
  EXPECT_THAT(imported.topics(), ElementsAre("/joy_vel", "/a"));
  imported = import_mux(topics({kNavigation}, {"name: l, topic: l, timeout: 0.5, priority: 10"}));
  EXPECT_THAT(imported.findings(), ElementsAre("4:47 warning lock-without-effect"));
  EXPECT_THAT(imported.plan->locks, IsEmpty());
  imported = import_mux(topics({"name: a, topic: a, timeout: 1, priority: 1"}));
  EXPECT_THAT(imported.findings(), ElementsAre("2:32 warning whole-timeout"));
  imported = import_mux(topics({kNavigation}, {"name: l, topic: l, timeout: 500.0, priority: 99"}));
  EXPECT_THAT(imported.findings(), ElementsAre("4:32 warning long-timeout"));
  EXPECT_THAT(imported.message("long-timeout"), HasSubstr("this is 500 s, "));
}

TEST(TwistMux, EqualsAreInTheOrderOfNamesInRos2) {
  const auto imported = import_mux(
      "twist_mux:\n  ros__parameters:\n    topics:\n"
      "      tablet: {topic: tab_vel, timeout: 0.5, priority: 100}\n"
      "      joystick: {topic: joy_vel, timeout: 0.5, priority: 100}\n");
  EXPECT_THAT(imported.topics(), ElementsAre("/joy_vel", "/tab_vel"));
  EXPECT_THAT(imported.findings(),
              ElementsAre("4:56 warning equal-priorities", "3:5 note no-use-stamped"));
  EXPECT_THAT(imported.message("equal-priorities"), HasSubstr("first one by name, \"joystick\""));
}

TEST(TwistMux, WhatCannotBeImportedIsAnError) {
  const auto findings = [](const std::string& text) { return import_mux(text).findings(); };
  EXPECT_THAT(findings(topics({"name: a, topic: a, timeout: 0.5"})),
              ElementsAre("2:3 error missing-value"));
  EXPECT_THAT(findings(topics({"name: a, topic: , timeout: 0.5, priority: 5"})),
              ElementsAre("2:13 error missing-value"));
  EXPECT_THAT(findings(topics({"topic: a, timeout: 0.5, priority: 5"})),
              ElementsAre("2:3 error missing-value"));
  // A misspelt key is both: what is unknown, and what is missing.
  EXPECT_THAT(findings(topics({"name: a, topic: a, time_out: 0.5, priority: 5"})),
              ElementsAre("2:3 error missing-value", "2:23 warning unknown-key"));
  EXPECT_THAT(findings(topics({"name: a, topic: a, timeout: .nan, priority: 5"})),
              ElementsAre("2:32 error invalid-timeout"));
  EXPECT_THAT(findings(topics({"name: a, topic: a, timeout: 1e300, priority: 5"})),
              ElementsAre("2:32 error invalid-timeout"));
  EXPECT_THAT(findings(topics({"name: a, topic: a, timeout: '0.5', priority: 5"})),
              ElementsAre("2:32 error invalid-timeout"));
  EXPECT_THAT(findings(topics({"name: a, topic: a, timeout: 0.5, priority: 5.0"})),
              ElementsAre("2:47 error invalid-priority"));
  EXPECT_THAT(findings(topics({"name: a, topic: a, timeout: 0.5, priority: 3000000000"})),
              ElementsAre("2:47 error invalid-priority"));
  EXPECT_THAT(findings(topics({"name: a, topic: 9 a, timeout: 0.5, priority: 5"})),
              ElementsAre("2:20 error invalid-topic"));
  EXPECT_THAT(findings(topics({"name: a, topic: /a//b, timeout: 1e-1, priority: 99999999999"})),
              ElementsAre("2:20 error invalid-topic", "2:36 error invalid-timeout",
                          "2:52 error invalid-priority"));
  EXPECT_THAT(findings(topics({"name: a, topic: /joy_vel, timeout: 0.5, priority: 5", kJoystick})),
              ElementsAre("2:20 error same-topic"));
  EXPECT_THAT(
      findings(topics({kNavigation}, {"name: l, topic: nav_vel, timeout: 0.5, priority: 11"})),
      ElementsAre("4:20 error same-topic"));
  EXPECT_THAT(findings(topics({kNavigation, "name: nav, topic: b, timeout: 0.5, priority: 5"})),
              ElementsAre("3:3 error given-twice"));
  EXPECT_THAT(findings(topics({"name: NULL, topic: a, timeout: 0.5, priority: 5"})),
              ElementsAre("2:3 error invalid-name"));
  EXPECT_THAT(findings(topics({"name: \"a\\x01\", topic: a, timeout: 0.5, priority: 5"})),
              ElementsAre("2:10 error invalid-name"));
  EXPECT_THAT(findings(topics({"name: '', topic: a, timeout: 0.5, priority: 5"})),
              ElementsAre("2:10 error invalid-name"));
  EXPECT_THAT(findings(topics({"name: a, topic: cmd_vel_out, timeout: 0.5, priority: 5"})),
              ElementsAre("2:20 error loops-back"));
  EXPECT_THAT(findings(topics({"name: a, topic: a, timeout: 0.5, priority: 0"})),
              ElementsAre("2:47 warning priority-zero", "2:3 error nothing-to-import"));
  EXPECT_THAT(findings("topics: []\n"), ElementsAre("1:1 error nothing-to-import"));
  EXPECT_THAT(findings("locks: []\n"), ElementsAre("1:1 error nothing-to-import"));
  EXPECT_THAT(findings("topics: [a]\n"), ElementsAre("1:10 error wrong-type"));
  EXPECT_THAT(findings("m: {ros__parameters: {topics: [a]}}\n"),
              ElementsAre("1:31 error wrong-type"));
}

TEST(TwistMux, TheOutputIsWhatTheUserSays) {
  importing::ImportOptions options;
  options.output_topic = "/cmd_vel";
  options.type = "my_msgs/msg/Command";
  options.domain = 7;
  const auto imported = import_mux(topics({kNavigation}), options);
  EXPECT_THAT(imported.findings(), ElementsAre("2:22 warning nothing-when-idle"));
  const std::string mapping = importing::write_mapping(*imported.plan, "m.xml");
  EXPECT_THAT(mapping, HasSubstr("<gateway kind=\"dds\" domain=\"7\">"));
  EXPECT_THAT(mapping, HasSubstr("topic=\"/cmd_vel\" type=\"my_msgs/msg/Command\"/>"));
  options.idle = importing::IdleChoice::kZero;
  EXPECT_THAT(importing::write_mapping(*import_mux(topics({kNavigation}), options).plan, "m.xml"),
              HasSubstr("type=\"my_msgs/msg/Command\" idle=\"zero\"/>"));
  options = {};
  options.idle = importing::IdleChoice::kNothing;
  EXPECT_THAT(importing::write_mapping(*import_mux(topics({kNavigation}), options).plan, "m.xml"),
              Not(HasSubstr("idle=")));
}

// SystemDefaultsQoS(): with Fast DDS it hears publishers of both kinds.
TEST(TwistMux, WhoeverItHearsTheGatewayHears) {
  const std::string ros2 =
      "m: {ros__parameters: {use_stamped: false, topics: {a: {topic: a, timeout: 0.5, priority: "
      "5}}, locks: {l: {topic: l, timeout: 0.5, priority: 9}}}}\n";
  const auto imported = import_mux(ros2);
  EXPECT_THAT(imported.findings(), IsEmpty());
  const std::string mapping = importing::write_mapping(*imported.plan, "m.xml");
  EXPECT_THAT(mapping, HasSubstr("port=\"/a/cmd_vel:o\" qos=\"system_default\"/>"));
  EXPECT_THAT(mapping, HasSubstr("false=\"/l/released:o\" qos=\"system_default\"/>"));
  EXPECT_THAT(importing::write_mapping(*import_mux(topics({kNavigation})).plan, "m.xml"),
              Not(HasSubstr("qos=")));
}

// What is said once must not be lost with one datagram.
TEST(TwistMux, ALockWithoutATimeoutIsHeardReliably) {
  const auto imported = import_mux(
      "m: {ros__parameters: {use_stamped: false, topics: {a: {topic: a, timeout: 0.5, priority: "
      "5}}, locks: {l: {topic: l, timeout: 0.0, priority: 9}}}}\n");
  ASSERT_TRUE(imported.plan);
  EXPECT_THAT(importing::write_mapping(*imported.plan, "m.xml"),
              HasSubstr("true=\"/l/pressed:o\" max_age=\"86400s\"/>"));
}

TEST(TwistMux, StampedTwistsAreTakenFromTheFile) {
  const auto imported = import_mux(
      "m: {ros__parameters: {use_stamped: true, use_sim_time: true, spare: 1,\n"
      "  topics: {a: {topic: a, timeout: 0.5, priority: 5}}}}\n");
  EXPECT_THAT(imported.findings(), ElementsAre("1:42 note own-clock", "1:62 warning unknown-key"));
  EXPECT_EQ(imported.plan->idle, "zero");
  EXPECT_EQ(imported.plan->type, importing::kTwistStamped);
  EXPECT_THAT(
      import_mux("m: {ros__parameters: {use_stamped: 1, topics: {a: {topic: a, timeout: 0.5, "
                 "priority: 5}}}}")
          .findings(),
      ElementsAre("1:36 error wrong-type"));
}

// A model without its locks decides, too, and nobody would notice.
TEST(TwistMux, AMisspeltSectionIsAnError) {
  for (const std::string key : {"lock", "topic", "Locks"}) {
    const auto imported = import_mux(
        "m: {ros__parameters: {use_stamped: false, topics: {a: {topic: a, timeout: 0.5, priority: "
        "5}},\n" +
        key + ": {e: {topic: e, timeout: 0.5, priority: 9}}}}\n");
    EXPECT_THAT(imported.findings(), ElementsAre("2:1 error unknown-key"));
    EXPECT_THAT(imported.message("unknown-key"), HasSubstr("did you mean"));
  }
}

// Names are whatever a file has; each becomes a port, a behaviour and a comment.
TEST(TwistMux, NamesMayBeAnything) {
  const auto imported =
      import_mux(topics({"name: 'a -- b -->', topic: a, timeout: 0.5, priority: 1",
                         "name: 'x<&\"]]>, y', topic: b, timeout: 0.5, priority: 2",
                         "name: 'x<&\"]]>_ y', topic: c, timeout: 0.5, priority: 3",
                         "name: '${base}', topic: d, timeout: 0.5, priority: 4",
                         "name: 'é', topic: e, timeout: 0.5, priority: 5"},
                        {"name: 'é', topic: l, timeout: 0.5, priority: 6"}));
  ASSERT_TRUE(imported.plan) << testing::PrintToString(imported.findings());
  // The letter has two bytes. A topic and a lock of one name share a folder.
  EXPECT_EQ(imported.plan->commands.front().port, "/__/cmd_vel:o");
  EXPECT_EQ(imported.plan->locks.front().port, "/__/released:o");
  EXPECT_EQ(imported.plan->commands[2].name, "x<&\"]]>_ y");
  EXPECT_EQ(imported.plan->commands[3].name, "x<&\"]]>_ y_2");
  ImportedRobot robot(*imported.plan);
  EXPECT_FALSE(robot.receives("/a", 1'000));
  robot.receives_lock("/l", false, 2'000);
  EXPECT_TRUE(robot.receives("/b", 3'000));
  EXPECT_FALSE(robot.receives("/a", 4'000));
  EXPECT_TRUE(robot.receives("/e", 5'000));
}

TEST(TwistMux, AsManyTopicsAsAnybodyHas) {
  std::vector<std::string> entries, locks;
  for (int i = 1; i <= 100; ++i) {
    const std::string n = std::to_string(i);
    entries.push_back("name: topic_number_" + n + ", topic: t" + n +
                      ", timeout: 0.5, priority: " + n);
    locks.push_back("name: lock_number_" + n + ", topic: l" + n + ", timeout: 0.5, priority: 101");
  }
  const auto imported = import_mux(topics(entries, locks));
  ASSERT_TRUE(imported.plan) << testing::PrintToString(imported.findings());
  ImportedRobot robot(*imported.plan);
  EXPECT_FALSE(robot.receives("/t10", 1'000));
  for (int i = 1; i <= 100; ++i) robot.receives_lock("/l" + std::to_string(i), false, 1'000);
  EXPECT_TRUE(robot.receives("/t50", 2'000));
  EXPECT_FALSE(robot.receives("/t49", 2'000));
  EXPECT_TRUE(robot.receives("/t51", 2'000));
}

}  // namespace
}  // namespace arbiter::test
