#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/importing/imported.hpp"

namespace arbiter::test {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;

Imported import_inputs(const std::string& text, const importing::ImportOptions& options = {}) {
  return import_texts(Program::kCmdVelMux, {text}, options);
}

std::string kobuki(const std::string& subscribers) {
  return "cmd_vel_mux: {ros__parameters: {subscribers: {\n" + subscribers + "}}}\n";
}

TEST(CmdVelMux, AModelIsWrittenForPeople) {
  const auto imported = import_inputs(
      kobuki("default_input: {topic: input/default, timeout: 0.1, priority: 0, short_desc: Any},\n"
             "remote: {topic: /remote, timeout: 0.5, priority: 9, short_desc: Remote control}\n"));
  EXPECT_THAT(imported.findings(), IsEmpty());
  ASSERT_TRUE(imported.plan);
  EXPECT_EQ(importing::write_model(*imported.plan), R"(<?xml version="1.0" encoding="UTF-8"?>
<!--
  What cmd_vel_mux decides, imported from a.yaml by `arbiter import cmd_vel_mux`.
-->
<behaviors>

  <define name="base"> /base/cmd_vel:i </define>

  <source port="/remote/cmd_vel:o" timeout="500ms"/>
  <source port="/default_input/cmd_vel:o" timeout="100ms"/>

  <!-- Remote control. -->
  <!-- /remote, priority 9, timeout 0.5 s: a.yaml:3 -->
  <behavior name="remote">
    <config at="${base}">/remote/cmd_vel:o</config>
    <inhibition>default_input</inhibition>
  </behavior>

  <!-- Any. -->
  <!-- /input/default, priority 0, timeout 0.1 s: a.yaml:2 -->
  <behavior name="default_input">
    <config at="${base}">/default_input/cmd_vel:o</config>
  </behavior>

</behaviors>
)");
  EXPECT_EQ(imported.plan->output_topic, "/cmd_vel");
}

TEST(CmdVelMux, YocsNamesAreBelowTheNode) {
  const auto imported = import_inputs(
      "subscribers:\n"
      "  - {name: Default input, topic: input/default, timeout: 0.1, priority: 0}\n"
      "  - {name: Safety, topic: /safety, timeout: 1, priority: 10, short_desc: Bumpers}\n"
      "publisher: output/cmd_vel\n");
  EXPECT_THAT(imported.findings(), IsEmpty());
  EXPECT_THAT(imported.topics(), ElementsAre("/safety", "/cmd_vel_mux/input/default"));
  EXPECT_EQ(imported.plan->commands[1].port, "/Default_input/cmd_vel:o");
  EXPECT_EQ(imported.plan->output_topic, "/cmd_vel_mux/output/cmd_vel");
}

TEST(CmdVelMux, WhatIsNotKeptIsReportedWithItsLine) {
  const std::string description = ", short_desc: x}";
  const auto imported =
      import_inputs(kobuki("a: {topic: a, timeout: 0.1, priority: 0" + description +
                           ",\nb: {topic: b, timeout: 0.2, priority: 1" + description +
                           ",\nc: {topic: c, timeout: 0.3, priority: 2" + description));
  EXPECT_THAT(imported.findings(), ElementsAre("3:24 note waits-longer"));
  EXPECT_THAT(imported.message("waits-longer"), HasSubstr("silent for 0.2 s"));
  EXPECT_THAT(importing::write_model(*imported.plan),
              HasSubstr("falls silent, cmd_vel_mux passes"));
}

TEST(CmdVelMux, WhatItRefusesIsRefused) {
  const auto findings = [](const std::string& text) { return import_inputs(text).findings(); };
  EXPECT_THAT(findings(kobuki("a: {topic: a, timeout: 0.0, priority: 0, short_desc: x}")),
              ElementsAre("2:24 error invalid-timeout"));
  EXPECT_THAT(findings(kobuki("a: {topic: a, timeout: 0.1, priority: -1, short_desc: x}")),
              ElementsAre("2:39 error invalid-priority"));
  EXPECT_THAT(findings(kobuki("a: {topic: a, timeout: 0.1, priority: 4294967296, short_desc: x}")),
              ElementsAre("2:39 error invalid-priority"));
  EXPECT_THAT(findings(kobuki("a: {topic: 9, timeout: 0.0, priority: -1, short_desc: x}")),
              ElementsAre("2:12 error invalid-topic", "2:24 error invalid-timeout",
                          "2:39 error invalid-priority"));
  EXPECT_THAT(findings(kobuki("a: {topic: a, timeout: 0.1, priority: 1}")),
              ElementsAre("2:1 warning no-description"));
  EXPECT_THAT(findings(kobuki("a: {topic: a, timeout: 0.1, priority: 1, short_desc: x},\n"
                              "b: {topic: b, timeout: 0.1, priority: 1, short_desc: x}")),
              ElementsAre("3:39 error equal-priorities"));
  EXPECT_THAT(findings("subscribers:\n- {name: a, topic: a, timeout: 0.1, priority: 1}\n"
                       "- {name: b, topic: b, timeout: 0.1, priority: 1}\n"),
              ElementsAre("3:47 warning equal-priorities"));
  EXPECT_THAT(findings(kobuki("a: {topic: cmd_vel, timeout: 0.1, priority: 1, short_desc: x}")),
              ElementsAre("2:12 error loops-back"));
  EXPECT_THAT(findings(kobuki("")), ElementsAre("1:33 error nothing-to-import"));
  EXPECT_THAT(findings("subscribers:\n"), ElementsAre("1:1 error nothing-to-import"));
  EXPECT_THAT(findings("subscribers: [{name: a, topic: a, timeout: 0.1, priority: 1}]\n"
                       "publisher: [x]\n"),
              ElementsAre("2:12 error wrong-type"));
}

}  // namespace
}  // namespace arbiter::test
