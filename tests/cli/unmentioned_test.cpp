// What is said of ports that the model in force does not mention.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <arbiter/arbiter.hpp>
#include <nlohmann/json.hpp>

#include "tests/cli/arbiter_program.hpp"
#include "tests/support/daemon.hpp"

namespace arbiter::test {
namespace {

using testing::AllOf;
using testing::HasSubstr;
using testing::Not;

const std::string kFaceUnlessStop =
    "<behaviors><arbiter at='/Gaze/pos:i'><select from='/Face/pos:o'>not /stop</select></arbiter>"
    "</behaviors>";

TEST(Unmentioned, PubAndEchoSayThatNothingPasses) {
  Daemon daemon(kFaceUnlessStop);
  auto result = arbiter({"pub", "/Fase/pos:o", "--count", "1"});
  EXPECT_EQ(result.exit_code, 0);
  EXPECT_EQ(result.err,
            "arbiter: the model in force does not mention /Fase/pos:o, so none of these samples is "
            "delivered; did you mean \"/Face/pos:o\"?\n");
  result = arbiter({"pub", "/other", "--count", "1"});
  EXPECT_THAT(result.err, HasSubstr("; `arbiter status` shows the ports that it mentions\n"));
  result = arbiter({"echo", "/Gaze/po:i", "--for", "1ms", "--as-component"});
  EXPECT_EQ(result.exit_code, 0);
  EXPECT_EQ(result.err,
            "arbiter: the model in force does not mention /Gaze/po:i, so no sample arrives; did "
            "you mean \"/Gaze/pos:i\"?\n");
}

TEST(Unmentioned, APortThatIsOpenTheWrongWayRoundIsNamedAsThat) {
  Daemon daemon(kFaceUnlessStop);
  const auto result = arbiter({"pub", "/Gaze/pos:i", "--count", "1"});
  EXPECT_THAT(result.err, HasSubstr("in the model in force /Gaze/pos:i is an input port, and here "
                                    "it is open as an output port, so none of these samples is "
                                    "delivered"));
  Node node("test");
  auto in = node.input_port("/stop");
  while (daemon.log().find("in the model in force /stop is an output port, and here it is open as "
                           "an input port, so no sample arrives") == std::string::npos) {
  }
}

// The daemon was given its files in another directory than this one.
TEST(Unmentioned, AReloadNamesFilesFromHere) {
  const TemporaryDirectory files;
  files.write("follow.xml", kFaceUnlessStop);
  Daemon daemon(kNoRules, {.arguments = {"--model", "follow.xml"},
                           .without_model = true,
                           .by = {"/usr/bin/env", "-C", files.path()}});
  const std::string whole = files.write("follow.xml", "<behaviors><x/></behaviors>");
  EXPECT_THAT(arbiter({"reload"}).err, testing::StartsWith(whole + ":1:12: error: <x> is not"));
  ASSERT_EQ(::unlink(whole.c_str()), 0);
  EXPECT_THAT(arbiter({"reload", "--dry-run"}).err,
              HasSubstr("cannot open " + whole + ": No such"));
}

TEST(Unmentioned, AChangeNamesInputPortsThatGetNothingFromNowOn) {
  Daemon daemon(kFaceUnlessStop);
  Node node("test");
  auto in = node.input_port("/Gaze/pos:i");
  auto out = node.output_port("/other:o");
  EXPECT_THAT(arbiter({"reload", "--dry-run"}).out, Not(HasSubstr("open")));
  EXPECT_THAT(arbiter({"reload"}).out, Not(HasSubstr("open")));
  daemon.write_model(
      "<behaviors><behavior name='A'><config at='/Arm/pos:i'>/a:o</config>"
      "</behavior></behaviors>");
  EXPECT_THAT(arbiter({"reload", "--dry-run"}).out,
              HasSubstr("\n  open now, and no longer mentioned by model \"default\", "
                        "so that no sample would arrive: /Gaze/pos:i\nthis was a dry run"));
  const auto unmentioned = [](const ProgramResult& result) {
    return nlohmann::json::parse(result.out).at("unmentioned");
  };
  const nlohmann::json gaze{"/Gaze/pos:i"};
  EXPECT_EQ(unmentioned(arbiter({"reload", "--dry-run", "--json"})), gaze);
  EXPECT_THAT(arbiter({"reload"}).out,
              HasSubstr("\n  open, but not mentioned by this model, so that no sample arrives: "
                        "/Gaze/pos:i\n"));
  EXPECT_EQ(unmentioned(arbiter({"reload", "--json"})), gaze);
  EXPECT_THAT(arbiter({"rollback"}).out, Not(HasSubstr("open")));
  EXPECT_EQ(unmentioned(arbiter({"reload", "--dry-run", "--json"})), gaze);
  daemon.write_model("<behaviors><x/></behaviors>");
  EXPECT_EQ(unmentioned(arbiter({"reload", "--json"})), nullptr);
}

TEST(Unmentioned, AWatcherSaysThatNobodyHasNamedThePort) {
  Daemon daemon(kFaceUnlessStop);
  const auto result = arbiter({"echo", "/Gaze/po:i", "--for", "1ms"});
  EXPECT_EQ(result.exit_code, 0);
  EXPECT_EQ(result.err,
            "arbiter: no model and no component has named /Gaze/po:i yet; did you mean "
            "\"/Gaze/pos:i\"?\n");
}

TEST(Unmentioned, NothingIsSaidOfPortsThatTheModelConnectsOrReads) {
  Daemon daemon(kFaceUnlessStop);
  Node node("test");
  auto in = node.input_port("/Gaze/pos:i");
  EXPECT_EQ(arbiter({"pub", "/Face/pos:o", "--count", "1"}).err, "");
  EXPECT_EQ(arbiter({"pub", "/stop", "--count", "1"}).err, "");
  EXPECT_EQ(arbiter({"echo", "/Gaze/pos:i", "--for", "1ms"}).err, "");
}

TEST(Unmentioned, PubSaysWhereNobodyHasTheInputPortOpen) {
  Daemon daemon(kFaceUnlessStop);
  const auto result = arbiter({"pub", "/Face/pos:o", "--count", "1"});
  EXPECT_EQ(result.exit_code, 0);
  EXPECT_EQ(result.err,
            "arbiter: no component has /Gaze/pos:i open, which the model connects to /Face/pos:o, "
            "so none of these samples is delivered\n");
}

TEST(Unmentioned, PubSaysThatTheTypesDiffer) {
  Daemon daemon(kFaceUnlessStop);
  NodeOptions quiet;
  quiet.on_notice = [](const Notice&) {};
  Node node("test", quiet);
  auto in = node.input_port<int>("/Gaze/pos:i");
  const auto result = arbiter({"pub", "/Face/pos:o", "--count", "1"});
  EXPECT_EQ(result.exit_code, 0);
  EXPECT_EQ(
      result.err,
      "arbiter: /Face/pos:o is not connected to /Gaze/pos:i: the output port of \"arbiter-pub\" "
      "sends untyped samples (up to 8 bytes), the input port of \"test\" takes int (4 bytes, "
      "aligned to 4)\n"
      "arbiter: to send what /Gaze/pos:i takes, run: arbiter pub /Face/pos:o --like /Gaze/pos:i "
      "--count 1  (samples of 4 bytes: add them by --hex, --file or --text, or they are zeros)\n");
  EXPECT_THAT(result.out, HasSubstr("refused 1"));
}

// Once, however often it is asked of; again for another that has the name.
TEST(Unmentioned, TheLogWarnsOnceOfEachPort) {
  Daemon daemon(kFaceUnlessStop);
  const auto count = [&](const std::string& text) {
    const std::string log = daemon.log();
    int found = 0;
    for (auto at = log.find(text); at != std::string::npos; at = log.find(text, at + 1)) ++found;
    return found;
  };
  NodeOptions quiet;
  quiet.on_notice = [](const Notice&) {};
  Node node("test", quiet);
  auto out = node.output_port<int>("/Fase/pos:o");
  auto in = node.input_port<int>("/Gaze/po:i");
  daemon.load(kFaceUnlessStop);
  daemon.load(kFaceUnlessStop);
  EXPECT_EQ(count("the model in force does not mention /Fase/pos:o, so none of these samples is "
                  "delivered; did you mean \"/Face/pos:o\"?"),
            1);
  EXPECT_EQ(count("the model in force does not mention /Gaze/po:i, so no sample arrives"), 1);
}

TEST(Unmentioned, WithoutAModelThatIsSaid) {
  Daemon daemon("", Daemon::Options{.without_model = true});
  EXPECT_EQ(arbiter({"pub", "/a", "--count", "1"}).err,
            "arbiter: no model is in force, so none of these samples is delivered\n");
  Node node("test");
  auto out = node.output_port<int>("/a");
  EXPECT_THAT(arbiter({"status"}).out, Not(HasSubstr("mention")));
}

TEST(Unmentioned, StatusMarksThem) {
  Daemon daemon(kFaceUnlessStop);
  Node node("test");
  auto out = node.output_port<int>("/Fase/pos:o");
  auto in = node.input_port<int>("/Gaze/po:i");
  EXPECT_EQ(daemon.source("/Fase/pos:o")["mentioned"], false);
  EXPECT_EQ(daemon.source("/Face/pos:o")["mentioned"], true);
  EXPECT_EQ(daemon.source("/stop")["mentioned"], true);
  EXPECT_EQ(daemon.input("/Gaze/po:i")["mentioned"], false);
  EXPECT_EQ(daemon.input("/Gaze/pos:i")["mentioned"], true);
  EXPECT_THAT(arbiter({"status"}).out,
              AllOf(HasSubstr("published 0  (the model does not mention it)\n"),
                    HasSubstr("not arbitrated (the model does not mention it)\n")));
}

}  // namespace
}  // namespace arbiter::test
