// What `arbiter switch NAME --all` makes of the answers of hosts.
#include "cli/switch_everywhere.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <map>

#include "wire/link_call.hpp"

namespace arbiter::cli {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;
using wire::HostAnswer;
using wire::HostOutcome;

const wire::SwitchRequest kRequest{42, "dance", {}};

HostAnswer yes(const std::string& host, std::uint64_t generation = 5) {
  wire::SwitchAnswer answer;
  answer.generation = generation;
  answer.model = "dance";
  return {host, host + "-1", HostOutcome::kAnswered, 1000, wire::write_switch_answer(answer)};
}
HostAnswer no(const std::string& host, const std::string& why) {
  return {host, host + "-1", HostOutcome::kRefused, 1000, why};
}
HostAnswer silent(const std::string& host) {
  return {host, host + "-1", HostOutcome::kSilent, 0, {}};
}

// Hosts that answer as they are told, and what they were asked.
class FakeHosts {
 public:
  std::map<std::string, std::vector<HostAnswer>> answers;  // by verb
  std::vector<std::string> asked;
  wire::HostsDocument seen;  // afterwards
  int looks = 0;
  int looks_in_vain = 0;  // at first
  bool hangs_up = false;  // before it is asked what has no answer

  SwitchEverywhere run(const wire::SwitchRequest& request = kRequest) {
    const auto ask = [&](const std::string& verb, const std::string& text) {
      EXPECT_EQ(wire::read_switch_request(text), request);
      asked.push_back(verb);
      if (!answers.contains(verb) && hangs_up) throw wire::NotAskedError("the link has hung up");
      if (!answers.contains(verb)) throw wire::CallError("the link has gone");
      return answers.at(verb);
    };
    return switch_everywhere(request, ask, [&] {
      if (++looks <= looks_in_vain) throw wire::CallError("the link ends");
      return seen;
    });
  }
};

// "a switched", each.
std::vector<std::string> outcomes(const SwitchEverywhere& result) {
  static constexpr const char* kNames[] = {"switched", "not switched", "unknown", "left out"};
  std::vector<std::string> all;
  for (const HostSwitch& each : result.hosts) {
    all.push_back(each.host + " " + kNames[static_cast<int>(each.outcome)]);
  }
  return all;
}

TEST(SwitchEverywhere, AllSwitchIfAllHavePrepared) {
  FakeHosts hosts;
  hosts.answers = {{"prepare", {yes("b"), yes("a")}}, {"commit", {yes("b", 6), yes("a", 9)}}};
  hosts.answers["commit"][0].took = 7000;
  const auto result = hosts.run();
  EXPECT_THAT(hosts.asked, ElementsAre("prepare", "commit"));
  EXPECT_THAT(outcomes(result), ElementsAre("a switched", "b switched"));
  EXPECT_EQ(result.hosts[0].generation, 9u);
  EXPECT_EQ(result.interval, 7000);
  EXPECT_EQ(exit_code_of(result), 0);
}

TEST(SwitchEverywhere, ANoOrSilenceOfOneMeansThatNoneSwitches) {
  const HostAnswer gone{"b", "b-1", HostOutcome::kGone, 0, {}};
  const HostAnswer nonsense{"b", "b-1", HostOutcome::kAnswered, 9, "{\"generation\": \"x\"}"};
  const HostAnswer escape = no("b", "\x1b[2J no");
  for (const HostAnswer& each : {no("b", "busy"), silent("b"), gone, nonsense, escape}) {
    FakeHosts hosts;
    hosts.answers = {{"prepare", {yes("a"), each}}, {"release", {}}};
    const auto result = hosts.run();
    EXPECT_THAT(hosts.asked, ElementsAre("prepare", "release")) << "a is not held up";
    EXPECT_THAT(outcomes(result), ElementsAre("a not switched", "b not switched"));
    EXPECT_FALSE(result.hosts[1].why.empty());
    EXPECT_EQ(result.hosts[1].why.find('\x1b'), std::string::npos);
    EXPECT_EQ(exit_code_of(result), 1);
  }
}

TEST(SwitchEverywhere, WithoutHostsNothingSwitches) {
  FakeHosts hosts;
  hosts.answers = {{"prepare", {}}};
  EXPECT_EQ(exit_code_of(hosts.run()), 1);
  hosts.answers = {{"prepare", {silent("a")}}};
  EXPECT_EQ(exit_code_of(hosts.run({42, "dance", {"a"}})), 1) << "all are left out";
  EXPECT_THAT(hosts.asked, ElementsAre("prepare", "prepare"));
}

TEST(SwitchEverywhere, AHostThatIsLeftOutDoesNotMatter) {
  FakeHosts hosts;
  wire::SwitchAnswer out;
  out.is_left_out = true;
  const HostAnswer left_out{"c", "c-1", HostOutcome::kAnswered, 9, wire::write_switch_answer(out)};
  hosts.answers = {{"prepare", {yes("a"), silent("b"), left_out}},
                   {"commit", {yes("a"), silent("b"), left_out}}};
  const auto result = hosts.run({42, "dance", {"b", "c"}});
  EXPECT_THAT(outcomes(result), ElementsAre("a switched", "b left out", "c left out"));
  EXPECT_EQ(exit_code_of(result), 0);
}

// Else the host that was meant would switch.
TEST(SwitchEverywhere, AHostThatIsNotKnownCannotBeLeftOut) {
  for (const std::vector<std::string>& without :
       {std::vector<std::string>{"heda"}, {"base", "x"}}) {
    FakeHosts hosts;
    hosts.answers = {{"prepare", {yes("base"), yes("head")}}, {"release", {}}};
    const auto result = hosts.run({42, "dance", without});
    EXPECT_THAT(hosts.asked, ElementsAre("prepare", "release"));
    EXPECT_FALSE(result.is_committed);
    EXPECT_THAT(result.why_none, HasSubstr("--without " + without.back()));
    EXPECT_EQ(exit_code_of(result), 1);
    if (without.size() == 1) {
      EXPECT_THAT(result.why_none, testing::EndsWith("did you mean \"head\"?"));
    }
  }
}

// It would be the one that does not switch, and nobody has asked for that.
TEST(SwitchEverywhere, AHostThatLeavesItselfOutIsANo) {
  FakeHosts hosts;
  wire::SwitchAnswer out;
  out.is_left_out = true;
  hosts.answers = {
      {"prepare",
       {yes("a"), {"b", "b-1", HostOutcome::kAnswered, 9, wire::write_switch_answer(out)}}},
      {"release", {}}};
  EXPECT_EQ(exit_code_of(hosts.run()), 1);
}

TEST(SwitchEverywhere, AfterTheFirstCommitEachIsWhatItSays) {
  wire::SwitchAnswer late;
  late.unknown = "the daemon did not answer";
  FakeHosts hosts;
  hosts.answers = {{"prepare", {yes("a"), yes("b"), yes("c"), yes("d"), yes("e")}},
                   {"commit",
                    {yes("a"),
                     no("b", "it is not prepared"),
                     silent("c"),
                     {"d", "d-1", HostOutcome::kAnswered, 9, wire::write_switch_answer(late)},
                     {"f", "f-1", HostOutcome::kRefused, 9, "it is not prepared"}}}};
  const auto result = hosts.run();
  EXPECT_THAT(outcomes(result), ElementsAre("a switched", "b not switched", "c unknown",
                                            "d unknown", "e unknown", "f not switched"));
  EXPECT_EQ(exit_code_of(result), 3);
}

TEST(SwitchEverywhere, AnotherLifeOfALinkHasPreparedNothing) {
  FakeHosts hosts;
  HostAnswer restarted = no("a", "it is not prepared");
  restarted.incarnation = "a-2";
  hosts.answers = {{"prepare", {yes("a"), yes("b")}}, {"commit", {restarted, yes("b")}}};
  const auto result = hosts.run();
  EXPECT_THAT(outcomes(result), ElementsAre("a unknown", "a not switched", "b switched"));
  EXPECT_EQ(exit_code_of(result), 3);
}

TEST(SwitchEverywhere, IfTheLinkGoesAfterTheCommitAllIsUnknown) {
  FakeHosts hosts;
  hosts.answers = {{"prepare", {yes("a")}}};
  const auto result = hosts.run();
  EXPECT_THAT(outcomes(result), ElementsAre("a unknown"));
  EXPECT_THAT(result.hosts[0].why, HasSubstr("the link has gone"));
  EXPECT_EQ(exit_code_of(result), 3);
}

// A link that joins its network again hangs up between the two questions.
TEST(SwitchEverywhere, IfTheCommitCannotBeAskedNoneHasSwitched) {
  FakeHosts hosts;
  hosts.answers = {{"prepare", {yes("a"), yes("b")}}};
  hosts.hangs_up = true;
  const auto result = hosts.run();
  EXPECT_FALSE(result.is_committed);
  EXPECT_EQ(result.why_none, "the link has hung up");
  EXPECT_THAT(outcomes(result), ElementsAre("a not switched", "b not switched"));
  EXPECT_THAT(result.hosts[0].why, HasSubstr("keeps its model"));
  EXPECT_EQ(hosts.looks, 0);
  EXPECT_EQ(exit_code_of(result), 1);
}

TEST(SwitchEverywhere, IfPreparedHostsRefuseNoneHasSwitched) {
  FakeHosts hosts;
  hosts.answers = {{"prepare", {yes("a")}}, {"commit", {no("a", "too late")}}};
  EXPECT_EQ(exit_code_of(hosts.run()), 1);
}

TEST(SwitchRequest, ComesBackAsItWasWritten) {
  const wire::SwitchRequest request{0xfedcba9876543210, "dance", {"base", "head"}};
  EXPECT_EQ(wire::read_switch_request(wire::write_switch_request(request)), request);
  EXPECT_EQ(wire::read_switch_request(wire::write_switch_request(kRequest)), kRequest);
}

TEST(SwitchRequest, WhatIsNoneIsNotRead) {
  std::string many = "000000000000002a\ndance";
  for (std::size_t i = 0; i <= wire::kMaxHostsLeftOut; ++i) many += "\nh";
  for (const std::string& text :
       {std::string(), std::string("000000000000002a"), std::string("000000000000002a\n"),
        std::string("0000000000000000\ndance"), std::string("2a\ndance"),
        std::string("000000000000002g\ndance"), std::string("000000000000002a\nda nce"),
        std::string("000000000000002a\ndance\n\nb"), std::string("000000000000002a\nda\x1bnce"),
        std::string("000000000000002a\n") + std::string(5000, 'x'), many}) {
    EXPECT_EQ(wire::read_switch_request(text), std::nullopt) << text;
  }
}

wire::HostStatus with_model(const std::string& host, std::uint64_t generation,
                            const std::string& model) {
  wire::HostStatus status;
  status.host = host;
  status.has_daemon = true;
  status.model.emplace();
  status.model->generation = generation;
  status.model->name = model;
  return status;
}

TEST(SwitchEverywhere, WhoDoesNotAnswerIsLookedAt) {
  FakeHosts hosts;
  hosts.answers = {{"prepare", {yes("a"), yes("b"), yes("c")}},
                   {"commit", {silent("a"), silent("b"), yes("c", 6)}}};
  hosts.seen.hosts = {with_model("a", 6, "dance"), with_model("b", 5, "calm")};
  const auto result = hosts.run();
  EXPECT_THAT(outcomes(result), ElementsAre("a switched", "b unknown", "c switched"));
  EXPECT_EQ(result.hosts[0].generation, 6u);
  EXPECT_THAT(result.hosts[0].why, HasSubstr("did not answer"));
  EXPECT_EQ(hosts.looks, kMostLooks) << "b may still switch";
  EXPECT_EQ(exit_code_of(result), 3);
}

TEST(SwitchEverywhere, WhatAHostSaidBeforeItPreparedOrIsGoneTellsNothing) {
  FakeHosts hosts;
  hosts.answers = {{"prepare", {yes("a", 5)}}, {"commit", {silent("a")}}};
  hosts.seen.hosts = {with_model("a", 4, "dance")};
  EXPECT_THAT(outcomes(hosts.run()), ElementsAre("a unknown"));
  hosts.seen.hosts = {with_model("a", 6, "dance")};
  hosts.seen.hosts[0].is_up = false;
  EXPECT_THAT(outcomes(hosts.run()), ElementsAre("a unknown"));
  hosts.seen.hosts[0].is_up = true;
  EXPECT_THAT(outcomes(hosts.run()), ElementsAre("a switched"));
}

// A link that joins its network again hangs up.
TEST(SwitchEverywhere, ALookThatFailsIsTakenAgain) {
  FakeHosts hosts;
  hosts.answers = {{"prepare", {yes("a")}}, {"commit", {silent("a")}}};
  hosts.seen.hosts = {with_model("a", 6, "dance")};
  hosts.looks_in_vain = 2;
  const auto result = hosts.run();
  EXPECT_THAT(outcomes(result), ElementsAre("a switched"));
  EXPECT_GT(result.interval, 0) << "it switched by then, though it did not answer";
}

TEST(SwitchEverywhere, OfTwoMachinesWithOneNameOnlyTheOneThatPreparedIsLookedAt) {
  FakeHosts hosts;
  hosts.answers = {{"prepare", {yes("a")}}, {"commit", {silent("a")}}};
  hosts.seen.hosts = {with_model("a", 6, "dance"), with_model("a", 5, "calm")};
  hosts.seen.hosts[0].incarnation = "a-2";
  hosts.seen.hosts[1].incarnation = "a-1";
  EXPECT_THAT(outcomes(hosts.run()), ElementsAre("a unknown"));
  hosts.seen.hosts[1].incarnation = "a-3";
  EXPECT_THAT(outcomes(hosts.run()), ElementsAre("a unknown")) << "either may be the one";
  hosts.seen.hosts[1].model->name = "dance";
  hosts.seen.hosts[1].incarnation = "a-1";
  EXPECT_THAT(outcomes(hosts.run()), ElementsAre("a switched"));
}

TEST(SwitchEverywhere, AHostThatHadTheModelHasNotSwitched) {
  FakeHosts hosts;
  hosts.answers = {{"prepare", {yes("arm", 5), yes("base", 5)}},
                   {"commit", {yes("arm", 5), yes("base", 6)}}};
  const auto written = [&] {
    const auto result = hosts.run();
    EXPECT_EQ(exit_code_of(result), 0);
    testing::internal::CaptureStdout();
    write_text(result, "dance");
    return testing::internal::GetCapturedStdout();
  };
  const std::string text = written();
  EXPECT_THAT(text, testing::StartsWith("arm   has it already: model 5\nbase  switched after "));
  EXPECT_THAT(text, HasSubstr("\n1 host switched to \"dance\" one by one"));
  hosts.answers["commit"] = {yes("arm", 5), yes("base", 5)};
  EXPECT_EQ(written(),
            "arm   has it already: model 5\nbase  has it already: model 5\n"
            "\"dance\" was in force already, so nothing has changed\n");
}

TEST(SwitchEverywhere, WhereAllHaveAnsweredNobodyIsLookedAt) {
  FakeHosts hosts;
  hosts.answers = {{"prepare", {yes("a")}}, {"commit", {yes("a", 6)}}};
  EXPECT_EQ(exit_code_of(hosts.run()), 0);
  EXPECT_EQ(hosts.looks, 0);
}

// Of JSON as well: its hosts do not say so.
TEST(SwitchEverywhere, SaysWhyNoneHasSwitched) {
  FakeHosts hosts;
  hosts.answers = {{"prepare", {yes("camera")}}, {"release", {}}};
  wire::SwitchRequest request = kRequest;
  request.without = {"camra"};
  const auto result = hosts.run(request);
  for (const auto write : {write_text, write_json}) {
    testing::internal::CaptureStdout();
    testing::internal::CaptureStderr();
    write(result, "dance");
    testing::internal::GetCapturedStdout();
    EXPECT_THAT(testing::internal::GetCapturedStderr(),
                HasSubstr("no host has switched to \"dance\": --without camra: no host of that "
                          "name is known; did you mean \"camera\"?"));
  }
}

}  // namespace
}  // namespace arbiter::cli
