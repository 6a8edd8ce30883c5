// arbiter why, against a running daemon with real components: each kind of cause.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <arbiter/arbiter.hpp>
#include <nlohmann/json.hpp>

#include "tests/cli/why_program.hpp"
#include "tests/client/component.hpp"
#include "tests/support/await.hpp"
#include "tests/support/daemon.hpp"

namespace arbiter::test {
namespace {

using nlohmann::json;
using testing::AllOf;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;
using testing::Not;

TEST(Why, TellsWhoInhibitsThroughWhomAndWhereItIsWritten) {
  Daemon daemon(kGazeModel);
  Node node("test");
  auto random = node.output_port<int>("/random");
  auto object = node.output_port<int>("/object");
  random.signal();
  object.signal();
  const std::string file = daemon.directory() + "/model.xml";
  const std::string text = why({"/gaze", "/random"});
  EXPECT_THAT(text, HasSubstr("/gaze: /object wins"));
  EXPECT_THAT(text, HasSubstr("\n/random is kept out\n  inhibited by behaviour \"Track\" through "
                              "meta-behaviour \"Curious\" (" +
                              file + ":7): /object is active (arrived "));
  EXPECT_THAT(text, Not(HasSubstr("\n/face")));
  const json answer = why_json({"/gaze"});
  EXPECT_EQ(answer["winner"], "/object");
  const json cause = connection(answer, "/random")["behaviours"][0]["causes"][0];
  EXPECT_EQ(cause["kind"], "inhibited");
  EXPECT_EQ(cause["inhibitor"]["name"], "Track");
  EXPECT_EQ(cause["of"]["name"], "Curious");
  EXPECT_EQ(cause["where"]["file"], file);
  EXPECT_EQ(cause["where"]["line"], 7);
  EXPECT_EQ(connection(answer, "/random")["reason"],
            json::parse(R"([{"source": "/object", "active": true}])"));
  EXPECT_EQ(connection(answer, "/object")["reason"], nullptr);
}

TEST(Why, TellsWhichConditionIsFalseAndWhatMakesItSo) {
  Daemon daemon(kGazeModel);
  Node node("test");
  auto object = node.output_port<int>("/object");
  auto collision = node.output_port<int>("/collision");
  object.signal();
  collision.signal();
  const std::string text = why({"/gaze"});
  EXPECT_THAT(text, HasSubstr("/gaze: idle, nobody wins"));
  EXPECT_THAT(text, HasSubstr("the condition of behaviour \"Track\", ¬/collision, is false (" +
                              daemon.directory() + "/model.xml:6): /collision is active"));
  EXPECT_THAT(text, HasSubstr("\n/collision is sensed"));
}

TEST(Why, TellsHowSomethingCameToBeInactive) {
  Daemon daemon(
      R"(<behaviors timeout="1ms"><source port="/ended" timeout="forever"/><arbiter at="/in">
<select from="/never"/><select from="/over">not /never</select>
<select from="/ended">not /never and not /over</select></arbiter></behaviors>)");
  Node node("test");
  auto over = node.output_port<int>("/over");
  auto ended = node.output_port<int>("/ended");
  over.signal();
  ended.signal();
  ended.deactivate();
  await([&] { return daemon.source("/over")["active"] != true; });
  EXPECT_THAT(why({"/in", "/never"}), HasSubstr("inactive (it has never arrived)"));
  EXPECT_THAT(why({"/in", "/ended"}), HasSubstr("inactive (deactivated "));
  EXPECT_THAT(why({"/in", "/over"}),
              AllOf(HasSubstr("inactive (last arrival "),
                    HasSubstr(" ago, T 1ms by " + daemon.directory() + "/model.xml:1)"),
                    HasSubstr("its rule (")));
}

TEST(Why, TellsSinceWhenWhereItCanBeKnown) {
  Daemon daemon(kGazeModel);
  EXPECT_THAT(why({"/gaze"}), HasSubstr("idle, nobody wins, since model 1 came into force "));
  Node node("test");
  auto random = node.output_port<int>("/random");
  auto face = node.output_port<int>("/face");
  random.signal();
  face.signal();
  const json before = why_json({"/gaze"})["since"];
  EXPECT_EQ(before["exact"], true);
  EXPECT_EQ(before["changed"][0]["became"], "active");
  face.signal();
  EXPECT_EQ(why_json({"/gaze"})["since"], before) << "it went on without a gap";
  EXPECT_THAT(why({"/gaze"}), HasSubstr(", since /face became active"));
  face.deactivate();
  const json since = why_json({"/gaze"})["since"];
  EXPECT_EQ(since["exact"], true);
  EXPECT_GT(since["at_least_ns"], before["at_least_ns"]);
  EXPECT_EQ(since["changed"][0]["became"], "deactivated");
  face.deactivate();
  EXPECT_EQ(why_json({"/gaze"})["since"], since) << "it was over";
  EXPECT_THAT(why({"/gaze"}), HasSubstr(", since /face was deactivated"));
}

// What it was that happened then, not what has become of the source since.
TEST(Why, TellsOfABeginningWhoseActivityIsOver) {
  Daemon daemon(R"(<behaviors timeout="forever"><arbiter at="/in">
<select from="/wanted">not /fault or /override</select></arbiter></behaviors>)");
  Node node("test");
  auto wanted = node.output_port<int>("/wanted");
  auto fault = node.output_port<int>("/fault");
  auto override_ = node.output_port<int>("/override");
  wanted.signal();
  fault.signal();
  override_.signal();
  fault.deactivate();
  override_.deactivate();
  const json since = why_json({"/in"})["since"];
  EXPECT_EQ(since["exact"], true);
  ASSERT_EQ(since["changed"].size(), 1u);
  EXPECT_EQ(since["changed"][0]["source"], "/override");
  EXPECT_EQ(since["changed"][0]["became"], "active");
  EXPECT_EQ(since["changed"][0]["at_ns"], since["at_least_ns"]);
  EXPECT_THAT(why({"/in"}), HasSubstr(", since /override became active"));
}

TEST(Why, TellsThatSomethingWentInactiveAndMadeTheWinner) {
  Daemon daemon(R"(<behaviors timeout="forever"><source port="/high" timeout="1ms"/>
<arbiter at="/in"><select from="/low">not /high</select><select from="/high"/></arbiter>
</behaviors>)");
  Node node("test");
  auto low = node.output_port<int>("/low");
  auto high = node.output_port<int>("/high");
  low.signal();
  high.signal();
  await([&] { return daemon.source("/high")["active"] != true; });
  const json since = why_json({"/in"})["since"];
  EXPECT_EQ(since["exact"], true);
  EXPECT_EQ(since["changed"][0]["source"], "/high");
  EXPECT_EQ(since["changed"][0]["became"], "expired");
  EXPECT_EQ(since["at_least_ns"], since["changed"][0]["at_ns"]);
  EXPECT_THAT(why({"/in"}), AllOf(HasSubstr("/low wins, for "),
                                  HasSubstr(", since /high went inactive, 1 ms after its last")));
}

TEST(Why, TellsOfPortsThatAreNotOpenAndOfTypesThatDoNotFit) {
  Daemon daemon(kGazeModel);
  EXPECT_THAT(why({"/gaze"}), HasSubstr("! no component has the port open"));
  EXPECT_THAT(why({"/gaze", "/face"}), HasSubstr("! no component has the output port open"));
  Node node("test");
  auto random = node.output_port<int>("/random");
  auto face = node.output_port<double>("/face");
  auto in = node.input_port<int>("/gaze");
  const json answer = why_json({"/gaze"});
  EXPECT_THAT(texts(answer["obstacles"]), IsEmpty());
  EXPECT_THAT(texts(connection(answer, "/random")["obstacles"]), IsEmpty());
  EXPECT_THAT(texts(connection(answer, "/face")["obstacles"]),
              ElementsAre(HasSubstr("the two ports do not fit")));
}

TEST(Why, TellsOfSamplesThatDidNotGetThrough) {
  Daemon daemon(kGazeModel);
  Node node("test");
  auto random = node.output_port<int>("/random");
  auto face = node.output_port<int>("/face");
  auto in = node.input_port<int>("/gaze", {.depth = 2, .when_full = refuse_new});
  for (int i = 0; i < 5; ++i) random.publish(i);
  EXPECT_THAT(
      texts(connection(why_json({"/gaze"}), "/random")["obstacles"]),
      ElementsAre(HasSubstr("3 samples have been refused since the ports were opened, because"),
                  HasSubstr("2 samples wait to be taken"),
                  HasSubstr("has not taken any of the 2 accepted samples")));
  face.signal();
  EXPECT_FALSE(in.take());
  EXPECT_THAT(texts(connection(why_json({"/gaze"}), "/random")["obstacles"]),
              testing::Contains(AllOf(HasSubstr("2 samples that had been accepted were dropped"),
                                      HasSubstr("since the ports were opened"))));
}

// Six samples fit: two for the publisher itself, one that the component holds, three for the queue.
TEST(Why, TellsOfAQueueThatThePublishersMemoryMakesSmaller) {
  Daemon daemon(kGazeModel);
  Node node("test");
  auto random = node.output_port<int>("/random", {.max_loans = 1, .max_memory = 6 * 64});
  auto in = node.input_port<int>("/gaze", {.depth = 8});
  for (int i = 0; i < 9; ++i) random.publish(i);
  const json connected = connection(why_json({"/gaze"}), "/random");
  EXPECT_THAT(texts(connected["obstacles"]),
              testing::Contains(AllOf(
                  HasSubstr("have been lost to newer ones since the ports were opened, because the "
                            "queue has 3 places in place of 8, because max_memory of /random "
                            "leaves no more"),
                  Not(HasSubstr("too slowly")))));
}

TEST(Why, TellsThatThePublishersMemoryHasNoRoomForAPort) {
  Daemon daemon(kGazeModel);
  Node node("test");
  auto random = node.output_port<int>("/random", {.max_loans = 1, .max_memory = 4 * 64});
  auto in = node.input_port<int>("/gaze", {.max_held = 60});
  EXPECT_THAT(texts(connection(why_json({"/gaze"}), "/random")["obstacles"]),
              ElementsAre("not connected: max_memory of /random leaves no room for another input "
                          "port"));
  const std::string status = arbiter({"status"}).out;
  EXPECT_THAT(status, HasSubstr("/random  NOT CONNECTED: max_memory of /random leaves no room"));
  EXPECT_THAT(status, Not(HasSubstr("MISMATCH")));
}

TEST(Why, TellsOfComponentsThatAreStoppedAndThatHaveDied) {
  Daemon daemon(kGazeModel);
  const std::string program = std::string(ARBITER_PROGRAMS) + "/arbiter";
  ChildProcess component({program, "pub", "/random", "--rate", "1000", "--quiet"}, {}, {});
  await([&] { return daemon.source("/random")["active"] == true; });
  component.stop();
  EXPECT_THAT(texts(connection(why_json({"/gaze"}), "/random")["obstacles"]),
              ElementsAre(AllOf(HasSubstr("its component arbiter-pub"), HasSubstr("is stopped"))));
  ASSERT_THAT(arbiter({"pub", "/random", "--count", "1"}).err, HasSubstr("is held by node"));
  component.kill();
  await([&] { return daemon.source("/random")["open"] == false; });
  const json random = connection(why_json({"/gaze"}), "/random");
  EXPECT_EQ(random["winner"], true) << "activity belongs to the source, not to the process";
  EXPECT_THAT(texts(random["obstacles"]),
              ElementsAre(AllOf(HasSubstr("open any longer; arbiter-pub"),
                                HasSubstr("had it open, and died")),
                          HasSubstr("arbiter deactivate /random ends it")))
      << "and nothing of who was refused while it lived";
  { Node("test").output_port<int>("/random").signal(); }
  EXPECT_THAT(why({"/gaze"}), HasSubstr("its component closed it or died, or the host"));
}

TEST(Why, TellsOfWhoHasDiedBeforeItPublished) {
  Daemon daemon(kGazeModel);
  Component component("face");
  ASSERT_EQ(component.tell("output /face"), "open");
  component.kill();
  await([&] { return daemon.source("/face")["open"] == false; });
  EXPECT_THAT(texts(connection(why_json({"/gaze"}), "/face")["obstacles"]),
              ElementsAre(AllOf(HasSubstr("open any longer; face (pid "),
                                HasSubstr(" had it open, and died"))));
}

TEST(Why, TellsOfConnectionsAndPortsWithoutRules) {
  Daemon daemon(kGazeModel, {.application = R"(<application>
<connection><from>/random</from><to>/gaze</to></connection>
<connection><from>/face</from><to>/gaze</to></connection>
<connection><from>/object</from><to>/gaze</to></connection>
<connection><from>/other</from><to>/gaze</to></connection>
<connection><from>/other</from><to>/free</to></connection></application>)"});
  EXPECT_THAT(why({"/gaze", "/other"}),
              HasSubstr("/other is kept out\n  no rule selects it, so it never delivers"));
  EXPECT_THAT(why({"/free"}),
              AllOf(HasSubstr("/free: not arbitrated"), HasSubstr("/other is delivered")));
  Node node("test");
  auto in = node.input_port<int>("/unheard-of");
  EXPECT_THAT(why({"/unheard-of"}), HasSubstr("the model in force does not mention it"));
  EXPECT_EQ(why_json({"/free"})["arbitrated"], false);
}

TEST(Why, RefusesNamesThatThereAreNotWithAdvice) {
  Daemon daemon(kGazeModel);
  const auto refused = [](std::vector<std::string> arguments) {
    arguments.insert(arguments.begin(), "why");
    const auto result = arbiter(arguments);
    EXPECT_EQ(result.exit_code, 1);
    EXPECT_EQ(result.out, "");
    return result.err;
  };
  EXPECT_THAT(refused({"/gase"}), HasSubstr("did you mean \"/gaze\"?"));
  EXPECT_THAT(refused({"/gase", "--follow"}), HasSubstr("did you mean \"/gaze\"?"));
  EXPECT_THAT(refused({"/face"}), HasSubstr("/face is an output port"));
  EXPECT_THAT(refused({"/gaze", "/fase"}), HasSubstr("did you mean \"/face\"?"));
  EXPECT_EQ(arbiter({"why"}).exit_code, 2);
  EXPECT_EQ(arbiter({"why", "/gaze", "/face", "--follow"}).exit_code, 2);
  EXPECT_EQ(arbiter({"why", "/gaze", "--count", "1"}).exit_code, 2);
}

TEST(Why, TellsThatThereIsNoDaemonOrThatThePolicyForbidsIt) {
  {
    const TemporaryDirectory empty;
    const ScopedVariable runtime("XDG_RUNTIME_DIR", empty.path());
    const auto result = arbiter({"why", "/gaze", "--instance", "no-such-daemon"});
    EXPECT_EQ(result.exit_code, 1);
    EXPECT_THAT(result.err, HasSubstr("no arbiterd of instance \"no-such-daemon\""));
  }
  const TemporaryDirectory files;
  const auto policy = files.write("policy", "deny everyone observe\n");
  Daemon daemon(kGazeModel, {.arguments = {"--policy", policy}});
  const auto result = arbiter({"why", "/gaze"});
  EXPECT_EQ(result.exit_code, 1);
  EXPECT_THAT(result.err, HasSubstr("deny everyone observe"));
  RawClient client(daemon.instance());
  client.hello();
  client.send(RawClient::message(wire::MessageKind::kModel));
  EXPECT_THAT(client.expect_refusal(), HasSubstr("deny everyone observe"));
}

TEST(Why, SpeaksOfTheModelInForceNotOfTheFile) {
  Daemon daemon(kGazeModel);
  daemon.write_model(
      "<behaviors><arbiter at='/gaze'><select from='/random'>/never</select>"
      "</arbiter></behaviors>");
  Node node("test");
  auto random = node.output_port<int>("/random");
  random.signal();
  EXPECT_THAT(why({"/gaze"}), AllOf(HasSubstr("/random wins"), HasSubstr("behaviour \"Look\"")));
  EXPECT_EQ(arbiter({"reload"}).exit_code, 0);
  EXPECT_THAT(why({"/gaze", "/random"}),
              AllOf(HasSubstr("idle"), HasSubstr("its condition, /never, is false"),
                    HasSubstr("model.xml:1): /never is inactive (it has never arrived)")));
}

TEST(Why, TellsWhatItCanOfAModelThatThePredecessorHasRead) {
  Daemon daemon(kGazeModel);
  Node node("test");
  auto random = node.output_port<int>("/random");
  auto object = node.output_port<int>("/object");
  random.signal();
  object.signal();
  daemon.kill();
  daemon.restart_without_model();
  const json answer = why_json({"/gaze"});
  EXPECT_EQ(answer["model"]["provenance_known"], false);
  EXPECT_EQ(answer["winner"], "/object");
  EXPECT_EQ(connection(answer, "/random")["reason"],
            json::parse(R"([{"source": "/object", "active": true}])"));
  EXPECT_THAT(why({"/gaze"}), AllOf(HasSubstr("but not the behaviours behind them"),
                                    HasSubstr("its rule does not hold: /object is active")));
}

}  // namespace
}  // namespace arbiter::test
