// arbiter why and arbiter status, of components that have not come back to a new daemon, and of
// those that it does not know.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <arbiter/arbiter.hpp>

#include "tests/cli/why_program.hpp"
#include "tests/client/component.hpp"
#include "tests/support/await.hpp"
#include "tests/support/daemon.hpp"

namespace arbiter::test {
namespace {

using nlohmann::json;
using testing::AllOf;
using testing::Contains;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;
using testing::Not;

const std::string kOneDefault =
    "<behaviors timeout='forever'><arbiter at='/arm'><select from='/rest'>not /track</select>"
    "<select from='/track'/></arbiter><arbiter at='/leg'><select from='/walk'/></arbiter>"
    "</behaviors>";

std::string status_text() {
  const auto result = arbiter({"status"});
  EXPECT_EQ(result.exit_code, 0) << result.err;
  return result.out;
}

TEST(WhyDaemon, SaysThatAPublisherIsSlowerThanItsT) {
  Daemon daemon(
      "<behaviors timeout='100ms'><arbiter at='/arm'><select from='/rest'/></arbiter></behaviors>");
  const ChildProcess slow({ARBITER_PROGRAMS "/arbiter", "pub", "/rest", "--rate", "4"}, {}, {});
  // It is asked again until it is inactive at that moment.
  std::string text;
  while (text.find("its last two arrivals") == std::string::npos) text = why({"/arm"});
  EXPECT_THAT(text,
              testing::ContainsRegex("! its last two arrivals were [0-9]+ ms apart, and its T "
                                     "is 100 ms: it is inactive in between"));
}

TEST(WhyDaemon, OfAComponentThatHasNotComeBackSaysThatWhatIsConnectedGoesOn) {
  Daemon daemon(kOneDefault);
  Node node("test");
  auto rest = node.output_port<int>("/rest");
  ChildProcess echo({ARBITER_PROGRAMS "/arbiter", "echo", "/arm", "--as-component"}, {}, {});
  // Once it has taken a sample it waits for no answer to the opening any more, which it would give
  // up when it is resumed.
  await([&] {
    rest.publish(1);
    const json connection = daemon.connection("/rest", "/arm");
    return connection["state"] == "connected" && connection["taken"] > 0;
  });
  echo.stop();
  daemon.kill();
  daemon.restart();
  ASSERT_EQ(daemon.input("/arm")["away"], true);
  const std::string pid = std::to_string(echo.pid());
  const std::string text = why({"/arm"});
  EXPECT_THAT(text, AllOf(HasSubstr("/arm: /rest wins"), Not(HasSubstr("nothing of it reaches")),
                          HasSubstr("! its component (pid " + pid + ") lives, but has not come "),
                          HasSubstr("its connections keep working"),
                          HasSubstr("(pid " + pid + ") is stopped")));
  const json answer = why_json({"/arm"});
  EXPECT_EQ(answer["nothing_comes_of_it"], nullptr);
  EXPECT_THAT(codes(answer["obstacles"]), ElementsAre("component-away", "component-stopped"));
  EXPECT_THAT(status_text(), AllOf(HasSubstr("/arm  [pid " + pid + ", stopped, has not come back"),
                                   HasSubstr("/rest  (input port away)")));
  echo.signal(SIGCONT);
  await([&] { return daemon.input("/arm")["away"] != true; });
  EXPECT_THAT(texts(why_json({"/arm"})["obstacles"]), IsEmpty());
}

// As a gateway does.
TEST(WhyDaemon, SaysWhatComponentsSayOfTheirPorts) {
  Daemon daemon(kOneDefault);
  Node node("gateway");
  auto rest = node.output_port<int>("/rest");
  auto track = node.output_port<int>("/track");
  auto arm = node.input_port<int>("/arm");
  rest.describe("DDS topic rt/rest-topic, no publisher matched");
  track.describe_trouble("iceoryx a/b/c, RouDi does not run\x1b[2J");
  arm.describe("DDS topic rt/arm, 1 subscriber matched");
  while (!daemon.source("/rest").contains("described") ||
         !daemon.source("/track").contains("described") ||
         !daemon.input("/arm").contains("described")) {
  }
  EXPECT_THAT(
      why({"/arm"}),
      AllOf(HasSubstr("\n  /arm goes to DDS topic rt/arm, 1 subscriber matched\n"),
            HasSubstr("\n  /rest comes from DDS topic rt/rest-topic, no publisher matched\n"),
            HasSubstr("\n  ! /track comes from iceoryx a/b/c, RouDi does not run\\x1b[2J\n")));
  EXPECT_THAT(codes(why_json({"/arm"})["obstacles"]), ElementsAre("outside"));
  for (const char* topic : {"/rest-topic", "/rt/rest-topic"}) {
    EXPECT_THAT(
        arbiter({"why", topic}).err,
        HasSubstr(std::string(topic) + " is no port: /rest comes from DDS topic rt/rest-topic\n"));
  }
  EXPECT_THAT(arbiter({"why", "/b/c"}).err, HasSubstr("no model and no component has named"));
  EXPECT_THAT(status_text(),
              AllOf(HasSubstr("  comes from DDS topic rt/rest-topic, no publisher matched\n"),
                    HasSubstr("  goes to DDS topic rt/arm, 1 subscriber matched\n")));
  rest.describe("");
  await([&] { return !daemon.source("/rest").contains("described"); });
}

TEST(WhyDaemon, SaysThatAComponentDescribedItsPortBeforeItWasStopped) {
  Daemon daemon(kOneDefault);
  Component gateway("gateway");
  ASSERT_EQ(gateway.tell("output /rest"), "open");
  ASSERT_EQ(gateway.tell("describe /rest"), "done");
  await([&] { return daemon.source("/rest").contains("described"); });
  EXPECT_THAT(why({"/arm"}), HasSubstr("\n  /rest comes from a topic\n"));
  gateway.process().stop();
  EXPECT_THAT(why({"/arm"}),
              HasSubstr("\n  /rest comes from a topic (as it said before it was stopped)\n"));
}

TEST(WhyDaemon, ThatHasLostItsStateSaysWhoRunsThatItDoesNotKnow) {
  Daemon daemon(kOneDefault);
  Node node("robot");
  auto rest = node.output_port<int>("/rest");
  auto arm = node.input_port<int>("/arm");
  daemon.kill();
  daemon.lose_state();
  daemon.restart();
  for (json told; told.empty() || told[0]["inputs"].empty();) told = daemon.status()["strangers"];
  const std::string who = "component robot (pid " + std::to_string(::getpid()) + ")";
  const std::string unknown = "! " + who + " lives and has it open, but this daemon does not know";
  const std::string text = why({"/arm"});
  EXPECT_THAT(text, AllOf(HasSubstr("nobody wins"), HasSubstr("\n  " + unknown),
                          Not(HasSubstr("no component has the port open")),
                          HasSubstr("\n/rest is kept out"), HasSubstr("restart it"),
                          HasSubstr("Never active (no component has them open): /track\n")));
  const json answer = why_json({"/arm"});
  EXPECT_THAT(codes(answer["obstacles"]), ElementsAre("component-unknown"));
  EXPECT_THAT(codes(connection(answer, "/rest")["obstacles"]), ElementsAre("component-unknown"));
  EXPECT_THAT(texts(why_json({"/leg"})["obstacles"]),
              Contains(HasSubstr("a component runs that this daemon does not know")));
  EXPECT_THAT(status_text(),
              AllOf(HasSubstr("unknown to this daemon"),
                    HasSubstr("  robot (pid " + std::to_string(::getpid()) + ") /rest /arm  ")));
}

}  // namespace
}  // namespace arbiter::test
