// arbiter why, of names that models and components have differently, and of who has what open.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <arbiter/arbiter.hpp>

#include "tests/cli/why_program.hpp"
#include "tests/support/await.hpp"
#include "tests/support/daemon.hpp"

namespace arbiter::test {
namespace {

using nlohmann::json;
using testing::AllOf;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::Not;

const std::string kMisnamed = R"(<behaviors timeout="forever">
<behavior name="Wander"><config at="/base">/wander</config></behavior>
<behavior name="Follow"><config at="/base">/follow</config>
  <condition>/deadmann</condition><inhibition>Wander</inhibition></behavior>
</behaviors>)";

const char* const kMeant = "which the model does not mention; did you mean that one?";

std::string pid() { return std::to_string(::getpid()); }

json sensed(const json& answer, const std::string& source) {
  for (const auto& each : answer.at("senses")) {
    if (each.at("source") == source) return each;
  }
  return nullptr;
}

TEST(WhyNames, TellsOfASourceThatIsOnlySensedWhatItWouldOfAConnection) {
  Daemon daemon(kMisnamed);
  EXPECT_THAT(codes(sensed(why_json({"/base"}), "/deadmann")["obstacles"]),
              ElementsAre("output-not-open"));
  Node node("test");
  auto follow = node.output_port<int>("/follow");
  auto deadman = node.output_port<int>("/deadman");
  follow.signal();
  const auto near = "! component test (pid " + pid() + ") has /deadman open, " + kMeant;
  EXPECT_THAT(why({"/base"}), HasSubstr(near));
  EXPECT_THAT(why({"/base", "/follow"}),
              HasSubstr("! /deadmann: component test (pid " + pid() + ") has /deadman open"));
  EXPECT_THAT(codes(sensed(why_json({"/base"}), "/deadmann")["obstacles"]),
              ElementsAre("output-not-open", "near-name"));
  auto meant = node.output_port<int>("/deadmann");
  EXPECT_THAT(
      why({"/base", "/deadmann"}),
      AllOf(HasSubstr("component test (pid " + pid() + ") has it open, and has sent nothing yet"),
            Not(HasSubstr("  ! /"))));
}

TEST(WhyNames, OfASourceTellsAtWhichPortsItMatters) {
  Daemon daemon(R"(<behaviors><source port="/stop:o"/>
<behavior name="Wander"><config at="/base">/wander</config><config at="/arm">/wander</config>
  <condition>not /stop:o</condition></behavior></behaviors>)");
  EXPECT_THAT(arbiter({"why", "/wander"}).err,
              HasSubstr("/wander is an output port, connected to /arm and /base; give the input "
                        "port first: arbiter why /arm /wander"));
  EXPECT_THAT(arbiter({"why", "/wander", "/base"}).err,
              HasSubstr("give the input port first: arbiter why /base /wander"))
      << "the port that was named";
  EXPECT_THAT(arbiter({"why", "/arm", "/base"}).err,
              HasSubstr("; it is an input port: name an output port behind /arm"));
  EXPECT_THAT(arbiter({"why", "/stop:o"}).err,
              HasSubstr("/stop:o is an output port, read at /arm and /base; give the input port "
                        "first: arbiter why /arm /stop:o"));
  EXPECT_THAT(arbiter({"why", "/wander", "--follow"}).err,
              HasSubstr("/wander is an output port, connected to /arm and /base; give the input "
                        "port first: arbiter why /arm --follow"));
  for (const bool follows : {false, true}) {
    const auto near =
        follows ? arbiter({"why", "/wnader", "--follow"}) : arbiter({"why", "/wnader"});
    EXPECT_EQ(near.exit_code, 1);
    EXPECT_THAT(near.err, HasSubstr("named the input port /wnader; did you mean the output port "
                                    "\"/wander\", connected to /arm and /base? Then give the "
                                    "input port first: arbiter why /arm "));
  }
}

TEST(WhyNames, TellsOfPortsUnderANearName) {
  Daemon daemon(kMisnamed);
  Node node("test");
  auto in = node.input_port<int>("/bas");
  auto out = node.output_port<int>("/wandr");
  EXPECT_THAT(why({"/base"}), HasSubstr("component test (pid " + pid() + ") has /bas open, "));
  EXPECT_THAT(why({"/bas"}), HasSubstr("! the model mentions /base; did you mean that one?"));
  EXPECT_THAT(codes(connection(why_json({"/base"}), "/wander")["obstacles"]),
              ElementsAre("output-not-open", "near-name"));
  // What the model mentions is meant as it is.
  auto named = node.output_port<int>("/follow");
  EXPECT_THAT(why({"/base", "/wander"}), Not(HasSubstr("/follow open")));
}

TEST(WhyNames, TellsHowToEndALatchWhoseProcessIsGoneAndElseWhoHoldsIt) {
  Daemon daemon(R"(<behaviors timeout="forever"><arbiter at="/base">
<select from="/drive">not /stop</select></arbiter></behaviors>)");
  Node node("test");
  auto drive = node.output_port<int>("/drive");
  drive.signal();
  {
    auto stop = node.output_port<int>("/stop");
    stop.signal();
    EXPECT_THAT(why({"/base"}), AllOf(HasSubstr("component test (pid " + pid() + ") has it open"),
                                      Not(HasSubstr("arbiter deactivate"))));
  }
  EXPECT_THAT(why({"/base"}),
              AllOf(HasSubstr("arbiter deactivate /stop ends it"), Not(HasSubstr("never active"))));
  EXPECT_THAT(why({"/base", "/drive"}), HasSubstr("! /stop: T is forever"));
  EXPECT_EQ(arbiter({"deactivate", "/stop"}).exit_code, 0);
  EXPECT_THAT(why({"/base"}), HasSubstr("/drive wins"));
}

TEST(WhyNames, DeactivationOfWhatIsNotActiveLeavesItsRecord) {
  Daemon daemon(R"(<behaviors timeout="1ms"><arbiter at="/base">
<select from="/a">not /b</select><select from="/b"/></arbiter></behaviors>)");
  {
    Node node("test");
    auto a = node.output_port<int>("/a");
    auto b = node.output_port<int>("/b");
    a.signal();
    await([&] { return daemon.source("/a")["active"] != true; });
  }
  const json before = connection(why_json({"/base"}), "/a")["last_arrival_ns"];
  EXPECT_NE(before, nullptr);
  for (const char* source : {"/a", "/b"}) {
    EXPECT_THAT(arbiter({"deactivate", source}).out, HasSubstr("was not active"));
  }
  EXPECT_EQ(connection(why_json({"/base"}), "/a")["last_arrival_ns"], before);
  EXPECT_THAT(why({"/base", "/b"}), HasSubstr("it has never arrived"));
}

TEST(WhyNames, DeactivationOfWhatNobodyHasSaysWhatWasMeant) {
  Daemon daemon(R"(<behaviors><arbiter at="/base"><select from="/stop:o"/></arbiter></behaviors>)");
  const auto result = arbiter({"deactivate", "/stpo:o"});
  EXPECT_EQ(result.exit_code, 1);
  EXPECT_EQ(result.out, "");
  EXPECT_THAT(result.err,
              HasSubstr("no model and no component has named the source /stpo:o; did you mean "
                        "\"/stop:o\"?"));
}

TEST(WhyNames, SaysOnTheFirstLineThatNothingOfTheWinnerArrives) {
  Daemon daemon(kMisnamed);
  Node node("test");
  auto wander = node.output_port<int>("/wander");
  wander.signal();
  const auto first_line = [] {
    const std::string text = why({"/base"});
    return text.substr(0, text.find('\n'));
  };
  const std::string nothing = "; but nothing of it reaches the port: ";
  EXPECT_THAT(first_line(), HasSubstr(nothing + "no component has it open"));
  {
    auto in = node.input_port<double>("/base");
    EXPECT_THAT(first_line(),
                AllOf(HasSubstr("idle, though /wander is selected"),
                      HasSubstr("; it cannot deliver: the output port of \"test\" sends int")));
    const json answer = why_json({"/base"});
    EXPECT_EQ(answer["winner"], nullptr);
    EXPECT_EQ(answer["selected"], "/wander");
    EXPECT_THAT(answer["nothing_comes_of_it"].get<std::string>(), HasSubstr("takes double"));
  }
  auto in = node.input_port<int>("/base");
  EXPECT_THAT(first_line(), HasSubstr(nothing + "test (pid " + pid() + ") only signals"));
  wander.publish(1);
  EXPECT_THAT(first_line(), Not(HasSubstr(nothing)));
  EXPECT_EQ(why_json({"/base"})["nothing_comes_of_it"], nullptr);
}

TEST(WhyNames, TellsWhereTheApplicationHasAConnectionWithoutARuleAndWhoReadsIt) {
  Daemon daemon(kMisnamed, {.application = R"(<application>
<connection><from>/wander</from><to>/base</to></connection>
<connection><from>/follow</from><to>/base</to></connection>
<connection><from>/deadmann</from><to>/base</to></connection>
<connection><from>/other</from><to>/base</to></connection></application>)"});
  const std::string file = daemon.directory() + "/application.xml:";
  EXPECT_THAT(why({"/base", "/other"}),
              AllOf(HasSubstr("never delivers here (" + file + "5)"), HasSubstr("nor does any")));
  EXPECT_THAT(why({"/base", "/deadmann"}),
              AllOf(HasSubstr("(" + file + "4)"), HasSubstr("counts for the rules that read it"),
                    HasSubstr("inactive (it has never arrived)")));
  EXPECT_EQ(connection(why_json({"/base"}), "/other")["where"]["line"], 5);
}

TEST(WhyNames, TellsWhoWouldLikeToWinFirstAndOnlyNamesWhoWasNeverStarted) {
  std::string rules;
  for (int i = 0; i < 12; ++i) {
    const std::string name = "/s" + std::to_string(100 + i);
    rules += "<select from='" + name + "'>/go</select>";
  }
  Daemon daemon("<behaviors timeout='forever'><arbiter at='/base' conflict='first'>" + rules +
                "</arbiter></behaviors>");
  Node node("test");
  auto ended = node.output_port<int>("/s100");
  auto active = node.output_port<int>("/s111");
  ended.signal();
  ended.deactivate();
  active.signal();
  const std::string text = why({"/base"});
  EXPECT_LT(text.find("\n/s111 is kept out"), text.find("\n/s100 is kept out"));
  EXPECT_THAT(text, AllOf(HasSubstr("has it open, and has sent nothing since\n  and by the rules: "
                                    "arbiter why /base /s100"),
                          HasSubstr("Never active (no component has them open): /s101, /s102"),
                          HasSubstr("\n/go is sensed"), Not(HasSubstr("\n/s101"))));
  EXPECT_THAT(why({"/base", "--all"}),
              AllOf(HasSubstr("\n/s101 is kept out"), Not(HasSubstr("Never active"))));
  EXPECT_THAT(why({"/base", "/s101"}), HasSubstr("\n/s101 is kept out"));
  EXPECT_EQ(why_json({"/base"})["connections"].size(), 12u);
}

// As many as a port can have, all active: the last inhibits all others, each all before it.
TEST(WhyNames, OfAPortWithAsManyConnectionsAsCanBeTellsWhatFitsAScreen) {
  constexpr int kCount = 255;
  const auto name = [](int i) { return "/s" + std::to_string(1000 + i); };
  std::string rules;
  for (int i = 0; i < kCount; ++i) {
    rules += "<behavior name='B" + std::to_string(i) + "'><config at='/base'>" + name(i) +
             "</config><inhibition>";
    for (int j = 0; j < i; ++j) rules += (j == 0 ? "B" : ", B") + std::to_string(j);
    rules += "</inhibition></behavior>\n";
  }
  Daemon daemon("<behaviors timeout='forever'>\n" + rules + "</behaviors>");
  Node node("test");
  std::vector<OutputPort<int>> ports;
  for (int i = 0; i < kCount; ++i) ports.push_back(node.output_port<int>(name(i)));
  for (auto& port : ports) port.signal();
  const std::string text = why({"/base"});
  EXPECT_LE(std::count(text.begin(), text.end(), '\n'), 30) << text;
  EXPECT_THAT(text,
              AllOf(HasSubstr("/base: /s1254 wins"), HasSubstr("\n/s1000 is kept out\n"),
                    HasSubstr("and for 251 more reasons like these"),
                    HasSubstr("\n252 more are kept out by the rules:\n"
                              "  252 inhibited by behaviour \"B254\" ("),
                    HasSubstr(": /s1002, /s1003, /s1004, /s1005, /s1006, /s1007 and 246 more"),
                    HasSubstr("arbiter why /base SOURCE shows one of them, --all shows all")));
  const std::string all = why({"/base", "--all"});
  EXPECT_THAT(all, AllOf(HasSubstr("\n/s1253 is kept out\n"), Not(HasSubstr("more are kept out"))));
  for (int i = 0; i + 1 < kCount; ++i) ports[static_cast<std::size_t>(i)].deactivate();
  EXPECT_THAT(why({"/base"}), HasSubstr("\n252 more are inactive: /s1002"));
}

// Its own activity counts in its decision, and is no reason to wait for.
TEST(WhyNames, ASourceIsNotToldThatItWouldWinWhereItsOwnActivityForbidsIt) {
  Daemon daemon(R"(<behaviors timeout="forever"><source port="/Nav/other:o"/>
<behavior name="Drive"><config at="/base">/Nav/vel:o</config>
  <condition>none(/Nav/*) or /Operator/ok:o</condition></behavior></behaviors>)");
  const std::string text = why({"/base", "/Nav/vel:o"});
  EXPECT_THAT(text, Not(HasSubstr("would select it")));
  EXPECT_THAT(text, HasSubstr("the condition of behaviour \"Drive\", none(/Nav/*) ∨ "
                              "/Operator/ok:o, would be false once it is active itself"));
  EXPECT_THAT(text, HasSubstr("/Operator/ok:o is inactive"));
  const auto cause = connection(why_json({"/base"}), "/Nav/vel:o")["behaviours"][0]["causes"][0];
  EXPECT_EQ(cause["by_own_activity"], true);
  EXPECT_EQ(cause["because"].size(), 1u);
  Node node("test");
  auto ok = node.output_port<int>("/Operator/ok:o");
  ok.signal();
  EXPECT_THAT(why({"/base", "/Nav/vel:o"}), HasSubstr("would select it, if it were active"));
}

// As the README opens a motor's port.
TEST(WhyNames, WhoKeepsTheNewestAloneLosesTheOthersOnPurpose) {
  Daemon daemon(kMisnamed);
  Node node("test");
  auto wander = node.output_port<int>("/wander");
  auto in = node.input_port<int>("/base", {.depth = 1});
  for (int i = 0; i < 3; ++i) wander.publish(i);
  EXPECT_THAT(why({"/base", "/wander"}),
              HasSubstr("\n  2 samples have been lost to newer ones since the ports were opened, "
                        "because the queue keeps the newest alone (depth 1)\n"));
}

TEST(WhyNames, CountsAsWaitingNoMoreThanThereIsRoomFor) {
  Daemon daemon(kMisnamed);
  Node node("test");
  auto wander = node.output_port<int>("/wander");
  auto in = node.input_port<int>("/base", {.depth = 2});
  for (int i = 0; i < 5; ++i) wander.publish(i);
  const json before = daemon.connection("/wander", "/base");
  EXPECT_EQ(before["waiting"], 2);
  EXPECT_EQ(before["overtaken"], 3);
  EXPECT_EQ(daemon.input("/base")["overtaken"], 3);
  std::string text = why({"/base", "/wander"});
  EXPECT_THAT(text, HasSubstr("\n  2 samples wait to be taken\n")) << "which is no fault";
  EXPECT_THAT(text, HasSubstr("\n  ! 3 samples have been lost to newer ones since"));
  EXPECT_TRUE(in.take());
  EXPECT_THAT(why({"/base", "/wander"}), HasSubstr("\n  1 sample waits to be taken\n"));
  const json after = daemon.connection("/wander", "/base");
  EXPECT_EQ(after["waiting"], 1);
  EXPECT_EQ(after["overtaken"], 3);
  EXPECT_EQ(daemon.input("/base")["overtaken"], 3);
}

}  // namespace
}  // namespace arbiter::test
