// arbiter why names the model in force: which it is, since when, whose doing, and what was before.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>

#include <arbiter/arbiter.hpp>

#include "tests/cli/why_program.hpp"
#include "tests/support/daemon.hpp"

namespace arbiter::test {
namespace {

using nlohmann::json;
using testing::AllOf;
using testing::HasSubstr;
using testing::Not;

std::string model_of(const std::string& port, const std::string& source,
                     const std::string& timeout = "forever") {
  return "<behaviors timeout='" + timeout + "'>\n<arbiter at='" + port + "'>\n<select from='" +
         source + "'/>\n</arbiter></behaviors>";
}

// A daemon with the models `first`, in force, and `second`, under relative paths.
class WhyOfTwoModels : public testing::Test {
 protected:
  const TemporaryDirectory files_;
  const std::string first_ = files_.write("first.xml", model_of("/arm", "/a"));
  const std::string second_ = files_.write("second.xml", model_of("/arm", "/b"));
  Daemon daemon_{kNoRules,
                 {.arguments = {"--model", "first=" + std::filesystem::relative(first_).string(),
                                "--model", "second=" + std::filesystem::relative(second_).string()},
                  .without_model = true}};

  std::string why_in_its_directory(const std::string& port) const {
    const auto result =
        run_program({"/bin/sh", "-c", "cd '" + files_.path() + "' && exec \"$0\" why " + port,
                     std::string(ARBITER_PROGRAMS) + "/arbiter"});
    EXPECT_EQ(result.exit_code, 0) << result.err;
    return result.out;
  }
};

TEST(Why, WarnsOfNamesThatNobodyHas) {
  const Daemon daemon(
      "<behaviors>\n<source port='/safety/estop:o'/>\n"
      "<arbiter at='/base'><select from='/nav'>not /safety/estopp:o</select></arbiter>\n"
      "</behaviors>");
  EXPECT_THAT(why({"/base"}), AllOf(HasSubstr("\nwarning: "), HasSubstr("model.xml:2:1: no rule "),
                                    HasSubstr("the name /safety/estopp:o stands only here")));
  const json warnings = why_json({"/base"})["warnings"];
  ASSERT_EQ(warnings.size(), 2u);
  EXPECT_EQ(warnings[1]["code"], "similar-name");
  EXPECT_EQ(warnings[1]["line"], 3);
}

TEST_F(WhyOfTwoModels, TellsWhichIsInForceSinceWhenAndWhoseDoingItIs) {
  EXPECT_THAT(why({"/arm"}),
              AllOf(HasSubstr("since model 1 came into force "),
                    HasSubstr("\n  by model 1 \"first\" (" + first_ + "), in force for "),
                    HasSubstr(" (start)\n")));
  EXPECT_EQ(arbiter({"switch", "second"}).exit_code, 0);
  EXPECT_THAT(why({"/arm"}), AllOf(HasSubstr("by model 2 \"second\" (" + second_ + ")"),
                                   HasSubstr(" (switch, by node \"arbiter-switch\" (pid ")));
  const json model = why_json({"/arm"})["model"];
  EXPECT_EQ(model["name"], "second");
  EXPECT_EQ(model["files"], json::array({second_}));
  EXPECT_EQ(model["how"], "switch");
  EXPECT_THAT(model["by"].get<std::string>(), HasSubstr("arbiter-switch"));
}

TEST_F(WhyOfTwoModels, ShowsPathsThatItsReaderCanOpen) {
  EXPECT_THAT(why_in_its_directory("/arm"), HasSubstr("by model 1 \"first\" (first.xml), "));
  EXPECT_THAT(why({"/arm", "/a"}), HasSubstr("(" + first_ + ":3)"));
  const auto drawn = run_program({"/bin/sh", "-c", "cd / && exec \"$0\" graph --live --format dot",
                                  std::string(ARBITER_PROGRAMS) + "/arbiter"});
  EXPECT_EQ(drawn.exit_code, 0) << drawn.err;
}

TEST_F(WhyOfTwoModels, TellsWhichOtherOneHasTheConnectionOrThePort) {
  const auto refused = arbiter({"why", "/arm", "/b"});
  EXPECT_EQ(refused.exit_code, 1);
  EXPECT_THAT(refused.err, AllOf(HasSubstr("in model 1 \"first\" (" + first_ + ")"),
                                 HasSubstr("model \"second\" has it: arbiter switch second")));
  files_.write("second.xml", model_of("/leg", "/b"));
  EXPECT_EQ(arbiter({"reload"}).exit_code, 0);
  EXPECT_THAT(why({"/leg"}), AllOf(HasSubstr("the model in force does not mention it"),
                                   HasSubstr("! model \"second\" mentions it: arbiter switch ")));
  const auto unknown = arbiter({"why", "/nothing"});
  EXPECT_THAT(unknown.err, HasSubstr("(model 2 \"first\" (" + first_ + ") is in force)"));
}

TEST_F(WhyOfTwoModels, TellsThatAFileSaysSomethingElseByNow) {
  EXPECT_EQ(why_json({"/arm"})["model"]["changed_files"], json::array());
  files_.write("first.xml", model_of("/arm", "/b"));
  EXPECT_THAT(why({"/arm"}), HasSubstr("! " + first_ + " has changed since; arbiter reload"));
  EXPECT_EQ(why_json({"/arm"})["model"]["changed_files"], json::array({first_}));
  EXPECT_THAT(why({"/arm"}),
              HasSubstr("unless it has errors (arbiter reload --dry-run checks it)"));
  std::filesystem::remove(first_);
  EXPECT_EQ(why_json({"/arm"})["model"]["changed_files"], json::array({first_}));
  EXPECT_EQ(why_json({"/arm"})["model"]["missing_files"], json::array({first_}));
  EXPECT_THAT(why({"/arm"}), HasSubstr("! " + first_ + " no longer exists: arbiter reload "));
  std::filesystem::create_directory(first_);
  EXPECT_EQ(why_json({"/arm"})["model"]["unreadable_files"], json::array({first_}));
  EXPECT_THAT(why({"/arm"}), HasSubstr("! " + first_ + " cannot be read from here"));
}

TEST_F(WhyOfTwoModels, AfterARollbackDoesNotAdviseToGoBackToWhatWasFledFrom) {
  EXPECT_EQ(why_json({"/arm"})["model"]["is_older"], false);
  files_.write("first.xml", model_of("/arm", "/b"));
  ASSERT_EQ(arbiter({"reload"}).exit_code, 0);
  EXPECT_EQ(why_json({"/arm"})["model"]["is_older"], false);
  ASSERT_EQ(arbiter({"rollback"}).exit_code, 0);
  EXPECT_EQ(why_json({"/arm"})["model"]["is_older"], true);
  EXPECT_THAT(why({"/arm"}),
              AllOf(HasSubstr("! " + first_ +
                              " differs from the model in force, which is an older one, "
                              "after a rollback; arbiter reload would replace it"),
                    HasSubstr("arbiter reload --dry-run"), Not(HasSubstr("has changed since"))));
  ASSERT_EQ(arbiter({"reload"}).exit_code, 0);
  EXPECT_EQ(why_json({"/arm"})["model"]["is_older"], false);
}

TEST_F(WhyOfTwoModels, OfADaemonWhoseFilesWereRefusedTellsWhichErrorKeepsThemOut) {
  Node node("test");  // it keeps the model in force
  auto port = node.output_port<int>("/a");
  daemon_.kill();
  files_.write("second.xml", "<behaviors><behaviour/></behaviors>");
  daemon_.restart();
  const auto error = AllOf(HasSubstr("the files of --model were refused"),
                           HasSubstr("second.xml:1:12: "), HasSubstr("arbiter reload"));
  const std::string text = why({"/arm"});
  EXPECT_THAT(text, AllOf(error, HasSubstr("! the files"), Not(HasSubstr("without --model"))));
  EXPECT_THAT(codes(why_json({"/arm"})["obstacles"]), testing::Contains("model-refused"));
  EXPECT_THAT(arbiter({"status"}).out, error);
  EXPECT_THAT(arbiter({"switch"}).out, error);
  const auto refused = arbiter({"switch", "second"});
  EXPECT_EQ(refused.exit_code, 1);
  EXPECT_THAT(refused.err, AllOf(HasSubstr("there is no model \"second\"; none is loaded"), error));
  const auto doctor = arbiter({"doctor"});
  EXPECT_EQ(doctor.exit_code, 1);
  EXPECT_THAT(doctor.out, AllOf(error, HasSubstr("[model-refused]"), HasSubstr("first.xml, ")));
  files_.write("second.xml", "<behaviors>\n<behaviour/></behaviors>");
  EXPECT_EQ(arbiter({"reload"}).exit_code, 1);
  EXPECT_THAT(why({"/arm"}), HasSubstr("second.xml:2:1: ")) << "as it was read last";
  files_.write("second.xml", model_of("/arm", "/b"));
  EXPECT_EQ(arbiter({"reload"}).exit_code, 0);
  EXPECT_THAT(why({"/arm"}), Not(HasSubstr("refused")));
  EXPECT_THAT(arbiter({"doctor"}).out, Not(HasSubstr("model-refused")));
  EXPECT_EQ(arbiter({"switch", "second"}).exit_code, 0);
}

TEST(WhyModel, TellsThatThereIsNone) {
  Daemon daemon(kNoRules, {.without_model = true});
  Node node("test");
  auto in = node.input_port<int>("/gaze");
  EXPECT_THAT(why({"/gaze"}),
              AllOf(HasSubstr("/gaze: no model is in force"), Not(HasSubstr("by"))));
}

TEST(WhyModel, OfAReloadThatChangesNothingForThePortDoesNotBeginAnew) {
  const auto two_ports = [](const std::string& gaze, const std::string& arm,
                            const std::string& timeout = "forever") {
    return "<behaviors timeout='" + timeout + "'><arbiter at='/gaze'><select from='" + gaze +
           "'/></arbiter><arbiter at='/arm'><select from='" + arm + "'/></arbiter></behaviors>";
  };
  Daemon daemon(two_ports("/a", "/b"));
  const auto since = [](const std::string& port) {
    return why_json({port})["since"]["at_least_ns"].get<shm::Nanoseconds>();
  };
  const auto began = since("/gaze");
  EXPECT_GT(began, 0);
  daemon.load(two_ports("/a", "/c"));
  EXPECT_EQ(since("/gaze"), began);
  EXPECT_GT(since("/arm"), began);
  EXPECT_THAT(why({"/gaze"}), HasSubstr("ago that decides here as the one in force does"));
  daemon.load(two_ports("/a", "/d"));
  EXPECT_EQ(since("/gaze"), began);
  daemon.load(two_ports("/a", "/d", "1s"));
  EXPECT_GT(since("/gaze"), began) << "its sources end otherwise than before";
}

TEST(WhyModel, ThatHasAnotherTDoesNotTellArrivalsByIt) {
  Daemon daemon(model_of("/arm", "/a", "1000s"));
  Node node("test");
  auto a = node.output_port<int>("/a");
  a.signal();
  daemon.load(model_of("/arm", "/a", "2000s"));
  EXPECT_THAT(why({"/arm"}), AllOf(HasSubstr("active (for "), HasSubstr("T was 1000s before"),
                                   HasSubstr("now T 2000s by " + daemon.directory())));
  EXPECT_EQ(connection(why_json({"/arm"}), "/a")["last_arrival_ns"], nullptr);
  daemon.load(model_of("/arm", "/a", "10s"));
  EXPECT_EQ(connection(why_json({"/arm"}), "/a")["last_arrival_ns"], nullptr);
  daemon.load(model_of("/arm", "/a", "forever"));
  a.signal();
  EXPECT_NE(connection(why_json({"/arm"}), "/a")["last_arrival_ns"], nullptr);
}

TEST(WhyModel, ThatHasAnotherTKnowsWhatIsActiveSinceBefore) {
  Daemon daemon(model_of("/arm", "/a", "1000s"));
  Node node("test");
  auto a = node.output_port<int>("/a");
  a.signal();
  daemon.load(model_of("/arm", "/a", "500ms"));  // its end lies further ahead than that
  EXPECT_THAT(why({"/arm"}), HasSubstr("/a wins, since model 2 came into force "));
  const json answer = why_json({"/arm"});
  EXPECT_EQ(answer["since"]["at_least_ns"], answer["model"]["in_force_since_ns"]);
}

TEST(WhyModel, ThatHasAnotherTTellsWhatArrivesUnderIt) {
  Daemon daemon(model_of("/arm", "/a", "1000s"));
  Node node("test");
  auto a = node.output_port<int>("/a");
  a.signal();
  daemon.load(model_of("/arm", "/a", "500s"));
  EXPECT_THAT(why({"/arm"}), HasSubstr("T was 1000s before the model changed it"));
  a.signal();
  EXPECT_THAT(why({"/arm"}), AllOf(HasSubstr("active (arrived "), HasSubstr(" ago, T 500s by ")));
  EXPECT_NE(connection(why_json({"/arm"}), "/a")["last_arrival_ns"], nullptr);
}

TEST(WhyModel, TellsTheTThatTheLastArrivalCameUnder) {
  Daemon daemon(model_of("/arm", "/a", "1000s"));
  Node node("test");
  auto a = node.output_port<int>("/a");
  a.signal();
  daemon.load(model_of("/arm", "/a", "2000s"));
  daemon.load(model_of("/arm", "/a", "3000s"));
  EXPECT_THAT(why({"/arm"}), AllOf(HasSubstr("T was 1000s before"), HasSubstr("now T 3000s by")));
  daemon.load(model_of("/arm", "/a", "1000s"));
  EXPECT_NE(connection(why_json({"/arm"}), "/a")["last_arrival_ns"], nullptr)
      << "it is the T that it came under";
}

TEST(WhyModel, TellsWhereTComesFrom) {
  Daemon daemon(
      "<behaviors>\n<source port='/a' timeout='forever'/>\n"
      "<arbiter at='/arm'><select from='/a'/></arbiter>"
      "<arbiter at='/leg'><select from='/b'/></arbiter></behaviors>");
  Node node("test");
  auto a = node.output_port<int>("/a");
  auto b = node.output_port<int>("/b");
  a.signal();
  b.signal();
  EXPECT_THAT(why({"/arm"}), HasSubstr("T forever by " + daemon.directory() + "/model.xml:2)"));
  EXPECT_THAT(why({"/leg"}), HasSubstr("T 500ms by default)"));
  EXPECT_EQ(connection(why_json({"/leg"}), "/b")["timeout_from"], "default");
}

}  // namespace
}  // namespace arbiter::test
