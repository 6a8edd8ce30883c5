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

std::string topics_of(const std::string& name) {
  return "{ros__parameters: {topics: {" + name + ": {topic: " + name +
         ", timeout: 0.5, priority: 1}}}}\n";
}

std::string locks_of(const std::string& name) {
  return "{ros__parameters: {locks: {" + name + ": {topic: " + name +
         ", timeout: 0.5, priority: 9}}}}\n";
}

Imported import_node(const std::string& node, const std::vector<std::string>& texts) {
  importing::ImportOptions options;
  options.node = node;
  return import_files(texts, options);
}

// The locks of another robot would lock this one.
TEST(Parameters, AFullNameIsOfThatNodeOnly) {
  const auto one =
      import_node("/mux", {"/mux: " + topics_of("a") + "/robot2/mux: " + locks_of("l")});
  ASSERT_TRUE(one.plan) << testing::PrintToString(one.findings());
  EXPECT_THAT(one.topics(), ElementsAre("/a"));
  EXPECT_EQ(one.plan->locks.size(), 0u);
  const std::string both = "/mux: " + topics_of("a") + "/robot2/mux: " + topics_of("b");
  for (const std::string node : {"/mux", "mux"}) {
    const auto imported = import_node(node, {both});
    ASSERT_TRUE(imported.plan) << node << testing::PrintToString(imported.findings());
    EXPECT_THAT(imported.topics(), ElementsAre("/a"));
  }
  EXPECT_THAT(import_node("/robot2/mux", {both}).topics(), ElementsAre("/robot2/b"));
  const auto deeper = import_node("/mux", {"/robot2/mux: " + topics_of("a")});
  EXPECT_THAT(deeper.findings(), ElementsAre("1:1 error no-such-node"));
  EXPECT_THAT(deeper.message("no-such-node"),
              HasSubstr("but \"/robot2/mux\" has; choose one by its full name: --node "
                        "\"/robot2/mux\""));
}

TEST(Parameters, TheEndOfANameIsOfOneNode) {
  const std::string file = "/a/mux: " + topics_of("a") + "/b/mux: " + locks_of("l");
  const auto imported = import_node("mux", {file});
  EXPECT_THAT(imported.findings(), ElementsAre("1:27 error several-nodes"));
  EXPECT_EQ(
      imported.message("several-nodes"),
      "several nodes called \"mux\" have `topics` or `locks`: \"/a/mux\" and \"/b/mux\"; choose "
      "one by its full name: --node \"/a/mux\", for example");
  EXPECT_THAT(import_node("a/mux", {file}).topics(), ElementsAre("/a/a"));
  EXPECT_THAT(import_node("mux", {"/a/mux: " + topics_of("a")}).topics(), ElementsAre("/a/a"));
  EXPECT_THAT(import_node("ux", {"/a/mux: " + topics_of("a")}).findings(),
              ElementsAre("1:1 error no-such-node"));
}

TEST(Parameters, APatternIsOfTheNodesThatItFits) {
  for (const std::string pattern : {"/**", "/*/mux", "/**/mux", "/a/*", "a/**"}) {
    for (const std::string node : {"", "/a/mux", "mux"}) {
      const auto imported =
          import_node(node, {"/a/mux: " + topics_of("a"), pattern + ": " + locks_of("l")});
      ASSERT_TRUE(imported.plan) << pattern << testing::PrintToString(imported.findings());
      EXPECT_EQ(imported.plan->locks.size(), 1u) << pattern;
    }
  }
  // Of another node, which somebody may have meant.
  const std::vector<std::string> files = {"/mux: " + topics_of("a"), "/*/mux: " + locks_of("l")};
  const auto imported = import_node("", files);
  EXPECT_THAT(imported.findings(), ElementsAre("1:25 error several-nodes"));
  EXPECT_THAT(imported.message("several-nodes"), HasSubstr("\"/*/mux\" and \"/mux\"; choose one by "
                                                           "its full name: --node \"/mux\""));
  const auto chosen = import_node("/mux", files);
  ASSERT_TRUE(chosen.plan) << testing::PrintToString(chosen.findings());
  EXPECT_EQ(chosen.plan->locks.size(), 0u);
  EXPECT_THAT(import_node("/other", {"/*/mux: " + topics_of("a")}).message("no-such-node"),
              HasSubstr("but \"/*/mux\" has; give the node's full name with --node"));
}

TEST(Parameters, SeveralPatternsAloneAreOfSeveralNodes) {
  const std::vector<std::string> files = {"/**: {ros__parameters: {" + kTopics + "}}",
                                          "/*/left: " + locks_of("l"),
                                          "/*/right: " + locks_of("r")};
  const auto open = import_files(files);
  EXPECT_THAT(open.findings(), ElementsAre("1:28 error several-nodes"));
  EXPECT_THAT(open.message("several-nodes"), HasSubstr("\"/*/left\" and \"/*/right\"; give the "
                                                       "node's full name with --node"));
  const auto imported = import_node("/robot/left", files);
  ASSERT_TRUE(imported.plan) << testing::PrintToString(imported.findings());
  EXPECT_THAT(imported.topics(), ElementsAre("/robot/a"));
  EXPECT_EQ(imported.plan->locks.size(), 1u);
  EXPECT_EQ(import_files({files[0], files[1]}).plan->locks.size(), 1u);
}

// ROS 2 reads "*" for a part of a word in no way that could be relied on.
TEST(Parameters, APatternOfPartsOfWordsIsOfNoNode) {
  const std::string pattern = "/other*/zz: " + locks_of("l");
  for (const std::string node : {"", "/mux", "mux"}) {
    const auto imported = import_node(node, {"/mux: " + topics_of("a") + pattern});
    ASSERT_TRUE(imported.plan) << testing::PrintToString(imported.findings());
    EXPECT_EQ(imported.plan->locks.size(), 0u);
    EXPECT_THAT(imported.findings(), testing::Contains("2:14 warning unknown-key"));
    EXPECT_THAT(imported.message("unknown-key"),
                HasSubstr("no node has the parameters of \"/other*/zz\""));
  }
  EXPECT_THAT(import_files({pattern}).findings(),
              ElementsAre("1:14 warning unknown-key", "1:1 error nothing-to-import"));
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
