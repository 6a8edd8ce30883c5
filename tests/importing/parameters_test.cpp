#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/importing/imported.hpp"

namespace arbiter::test {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;

const std::string kTopics = "topics: {a: {topic: a, timeout: 0.5, priority: 1}}";

Imported import_files(const std::vector<std::string>& texts,
                      const importing::ImportOptions& options = {}) {
  return import_texts(Program::kTwistMux, texts, options);
}

TEST(Parameters, AreFoundInTheFileOfARobot) {
  const auto imported =
      import_files({"other_node:\n  ros__parameters: {topics: 3, rate: 10.0}\n"
                    "twist_mux:\n  ros__parameters: {" +
                    kTopics + "}\n"});
  ASSERT_TRUE(imported.plan) << testing::PrintToString(imported.findings());
  EXPECT_THAT(imported.topics(), ElementsAre("/a"));
}

TEST(Parameters, ANamespaceMayBeInTheNameOrAboveIt) {
  for (const std::string& file : {"/robot/twist_mux: {ros__parameters: {" + kTopics + "}}",
                                  "robot: {twist_mux: {ros__parameters: {" + kTopics + "}}}"}) {
    const auto imported = import_files({file});
    ASSERT_TRUE(imported.plan) << testing::PrintToString(imported.findings());
    EXPECT_THAT(imported.topics(), ElementsAre("/robot/a"));
    EXPECT_EQ(imported.plan->output_topic, "/robot/cmd_vel_out");
  }
}

TEST(Parameters, OfTheOtherMultiplexerAreNamedAsThat) {
  const auto imported = import_texts(Program::kCmdVelMux, {kTopics});
  EXPECT_THAT(imported.findings(), ElementsAre("1:1 error nothing-to-import"));
  EXPECT_THAT(imported.message("nothing-to-import"),
              HasSubstr("but `topics` or `locks`, as a twist_mux has; write: arbiter import "
                        "twist_mux"));
  EXPECT_THAT(import_files({"subscribers: {a: {topic: a}}"}).message("nothing-to-import"),
              HasSubstr("write: arbiter import cmd_vel_mux"));
}

TEST(Parameters, APatternLeavesTheNamespaceOpen) {
  const std::string file = "/**: {ros__parameters: {" + kTopics + "}}";
  EXPECT_THAT(import_files({file}).topics(), ElementsAre("/a"));
  importing::ImportOptions options;
  options.name_space = "/robot";
  EXPECT_THAT(import_files({file}, options).topics(), ElementsAre("/robot/a"));
  options = {};
  options.node = "/robot/twist_mux";
  EXPECT_THAT(import_files({file}, options).topics(), ElementsAre("/robot/a"));
}

TEST(Parameters, OneOfSeveralNodesIsChosen) {
  const std::string file =
      "left: {mux: {ros__parameters: {" + kTopics +
      "}}}\n"
      "right: {mux: {ros__parameters: {topics: {b: {topic: b, timeout: 0.5, priority: 1}}}}}\n";
  const auto imported = import_files({file});
  EXPECT_THAT(imported.findings(), ElementsAre("1:31 error several-nodes"));
  EXPECT_THAT(imported.message("several-nodes"), HasSubstr("\"/left/mux\" and \"/right/mux\""));
  importing::ImportOptions options;
  options.node = "/right/mux";
  EXPECT_THAT(import_files({file}, options).topics(), ElementsAre("/right/b"));
  options.node = "/middle/mux";
  EXPECT_THAT(import_files({file}, options).findings(), ElementsAre("1:1 error no-such-node"));
}

TEST(Parameters, SeveralFilesAreOne) {
  const auto imported =
      import_files({"twist_mux: {ros__parameters: {" + kTopics + "}}",
                    "/**: {ros__parameters: {locks: {l: {topic: l, timeout: 0.5, priority: 9}}}}"});
  ASSERT_TRUE(imported.plan) << testing::PrintToString(imported.findings());
  EXPECT_EQ(imported.plan->locks.size(), 1u);
  const std::string mux = "twist_mux: {ros__parameters: {" + kTopics + "}}";
  EXPECT_THAT(import_files({mux, mux}).findings(), ElementsAre("1:31 error given-twice"));
  EXPECT_THAT(import_files({mux, "locks: []"}).findings(), ElementsAre("1:1 error mixed-forms"));
}

TEST(Parameters, AMisspeltRosParametersIsNoNode) {
  for (const std::string key : {"ros__parameter", "ros_parameters", "ros__paramters"}) {
    const auto imported = import_files({"twist_mux: {" + key + ": {" + kTopics + "}}"});
    EXPECT_THAT(imported.findings(), ElementsAre("1:13 error unknown-key")) << key;
    EXPECT_THAT(imported.message("unknown-key"), HasSubstr("did you mean \"ros__parameters\"?"));
  }
  // Of another node it is not the import's business.
  const auto imported =
      import_files({"other: {ros__parameter: {rate: 10}}\n"
                    "twist_mux: {ros__parameters: {" +
                    kTopics + "}}"});
  EXPECT_TRUE(imported.plan) << testing::PrintToString(imported.findings());
}

// They would be left out, of a model that then decides otherwise.
TEST(Parameters, NamesWithDotsAreNotPassedOver) {
  const auto imported = import_files({"twist_mux: {ros__parameters: {" + kTopics +
                                      ", locks.stop.topic: stop, locks.stop.timeout: 0.5}}"});
  ASSERT_EQ(imported.findings().size(), 1u);
  EXPECT_THAT(imported.findings().front(), HasSubstr("error dotted-name"));
  const auto others =
      import_files({"other: {ros__parameters: {rate.a: 1}}\n"
                    "twist_mux: {ros__parameters: {" +
                    kTopics + "}}"});
  EXPECT_TRUE(others.plan) << testing::PrintToString(others.findings());
}

TEST(Parameters, AMapOfEntriesIsBelowRosParametersOnly) {
  for (const std::string& file : {kTopics, "twist_mux: {" + kTopics + "}"}) {
    const auto imported = import_files({file});
    ASSERT_EQ(imported.findings().size(), 1u) << file;
    EXPECT_THAT(imported.findings().front(), HasSubstr("error wrong-type"));
    EXPECT_THAT(imported.message("wrong-type"), HasSubstr("only below `ros__parameters`"));
  }
}

TEST(Parameters, AFileOfSomethingElseIsAnError) {
  EXPECT_THAT(import_files({"other: {ros__parameters: {rate: 10}}"}).findings(),
              ElementsAre("1:1 error nothing-to-import"));
  EXPECT_THAT(import_files({"just words"}).findings(), ElementsAre("1:1 error nothing-to-import"));
  EXPECT_THAT(import_files({"- a\n- b\n"}).findings(), ElementsAre("1:1 error nothing-to-import"));
  EXPECT_THAT(import_files({"a: [\n"}).findings(), ElementsAre("2:1 error invalid-yaml"));
}

}  // namespace
}  // namespace arbiter::test
