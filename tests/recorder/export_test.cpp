// `arbiter recording export`.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <sstream>

#include <nlohmann/json.hpp>

#include "tests/cli/arbiter_program.hpp"
#include "tests/evidence/incident.hpp"
#include "tests/recorder/in_zone.hpp"
#include "tests/support/text_files.hpp"

namespace arbiter::test {
namespace {

TEST(Export, WritesATraceThatSimulateReads) {
  const TemporaryDirectory directory;
  Incident incident;
  incident.state("/low", 0, 995, shm::arrival(800, 500));  // active already
  incident.arrive("/high", 1100, 1101, Incident::Fate::accepted);
  incident.arrive("/low", 1120, 1121, Incident::Fate::discarded);
  incident.deactivate("/high", 1150, 1151);
  incident.arrive("/low", 1200, 1201, Incident::Fate::accepted);
  const std::string trace = directory.file("trace.csv");
  const std::string csv = directory.file("decisions.csv");
  const auto result =
      arbiter({"recording", "export", incident.file(), "--trace", trace, "--csv", csv});
  ASSERT_EQ(result.exit_code, 0) << result.err;
  EXPECT_EQ(content_of(trace),
            "t_ns,source,event\n800,/low,arrive\n1100,/high,arrive\n1120,/low,arrive\n"
            "1150,/high,deactivate\n1200,/low,arrive\n");
  EXPECT_EQ(content_of(csv),
            "t_ns,source,destination,decision,winner\n1100,/high,/p,delivered,/high\n"
            "1120,/low,/p,discarded,/high\n1200,/low,/p,delivered,/low\n");
  // What simulate makes of the trace has the same decisions in it.
  const auto simulated =
      arbiter({"simulate", directory.write("model.xml", kOverride), "--trace", trace});
  EXPECT_EQ(simulated.out,
            "t_ns,source,destination,decision,winner\n800,/low,/p,delivered,/low\n"
            "1100,/high,/p,delivered,/high\n1120,/low,/p,discarded,/high\n1150,/high,/p,-,/low\n"
            "1200,/low,/p,delivered,/low\n");
}

// A trace that began at 0 would be played for as long as the machine has run.
TEST(Export, BeginsNoTraceWithWhatAPublisherFinds) {
  const TemporaryDirectory directory;
  Incident incident;
  incident.state("/high", 0, 1050, shm::deactivation(0), evidence::SourceState::Why::joined);
  incident.state("/low", 0, 1060, shm::deactivation(700), evidence::SourceState::Why::joined);
  incident.arrive("/low", 1100, 1101, Incident::Fate::accepted);
  // A publisher was killed before it could tell.
  incident.state("/low", 1100, 1151, shm::deactivation(1150), evidence::SourceState::Why::closed);
  const std::string trace = directory.file("trace.csv");
  ASSERT_EQ(arbiter({"recording", "export", incident.file(), "--trace", trace}).exit_code, 0);
  EXPECT_EQ(content_of(trace), "t_ns,source,event\n1100,/low,arrive\n1150,/low,deactivate\n");
}

// As in a simulation: nothing of it is decided there, but it may change who wins.
TEST(Export, HasRowsForSourcesThatOpenPortsOnlyRead) {
  const TemporaryDirectory directory;
  Incident incident(R"(<behaviors timeout="500ns">
  <behavior name="Go"><config at="/p">/low</config><condition>not /stop</condition></behavior>
  <behavior name="Go elsewhere"><config at="/closed">/low</config><condition>/stop</condition></behavior>
</behaviors>
)",
                    {"/low", "/stop"});
  evidence::PortChange open;
  open.what = evidence::PortChange::What::open;
  open.is_input = true;
  open.port = "/p";
  open.seen = 1000;
  incident.add(open);
  incident.arrive("/low", 1100, 1101, Incident::Fate::accepted);
  incident.arrive("/stop", 1110, 1111, Incident::Fate::none);
  incident.arrive("/low", 1120, 1121, Incident::Fate::discarded);
  open.what = evidence::PortChange::What::closed;
  open.seen = 1130;
  incident.add(open);
  incident.arrive("/stop", 1140, 1141, Incident::Fate::none);
  const std::string csv = directory.file("decisions.csv");
  const auto result = arbiter({"recording", "export", incident.file(), "--csv", csv});
  ASSERT_EQ(result.exit_code, 0) << result.err;
  EXPECT_EQ(content_of(csv),
            "t_ns,source,destination,decision,winner\n1100,/low,/p,delivered,/low\n"
            "1110,/stop,/p,discarded,-\n1120,/low,/p,discarded,-\n");
}

// The wall clock was 5 ms ahead of the recording's times: they begin at 1970-01-01
// 00:00:00.005.
TEST(RecordedWinners, SaysWhoCommandedAtATimeOfTheClock) {
  constexpr shm::Nanoseconds kMs = 1'000'000;
  Incident incident(kOverride, {"/low", "/high"});
  const auto change = [&](const char* winner, const char* before, shm::Nanoseconds time,
                          evidence::WinnerChange::Why why, const char* by) {
    incident.add(evidence::WinnerChange{"/p", winner, before, time, why, by, 1});
  };
  using Why = evidence::WinnerChange::Why;
  change("", "", 1000, Why::start, "");
  change("/low", "", 1000 * kMs, Why::arrival, "/low");
  change("/high", "/low", 2500 * kMs, Why::arrival, "/high");
  change("/low", "/high", 2700 * kMs, Why::expiry, "/high");
  incident.arrive("/low", 4000 * kMs, 4000 * kMs, Incident::Fate::accepted);
  const std::string file = incident.file();
  const auto winners = [&](const std::vector<std::string>& more) {
    std::vector<std::string> arguments{"recording", "winners", file};
    arguments.insert(arguments.end(), more.begin(), more.end());
    return arbiter_in_utc(arguments);
  };
  const std::string low = "1970-01-01 00:00:01.005  /p  /low  for 1.500 s: /low arrived\n";
  const std::string high = "1970-01-01 00:00:02.505  /p  /high  for 0.200 s: /high arrived\n";
  const std::string again =
      "1970-01-01 00:00:02.705  /p  /low  for 1.300 s, until the end of the recording: /high went "
      "inactive\n";
  EXPECT_THAT(winners({}).out,
              testing::AllOf(testing::HasSubstr("/p  idle  for 1.000 s: it was so when the "),
                             testing::EndsWith(low + high + again)));
  EXPECT_EQ(winners({"--at", "00:00:02"}).out, low + high + again) << "in all of that second";
  EXPECT_EQ(winners({"--at", "00:00:02.600"}).out, high);
  EXPECT_EQ(winners({"--at", "1970-01-01 00:00:03"}).out, again);
  EXPECT_EQ(winners({"--at", "00:00:03", "--port", "/q*"}).out,
            "nobody won at 00:00:03, at an input port that matches /q*\n");
  EXPECT_EQ(winners({"--port", "/p"}).err, "");
  EXPECT_EQ(winners({"--port", "/pp"}).err,
            "arbiter: warning: --port /pp matches no input port of which the recording tells; did "
            "you mean \"/p\"?\n");
  EXPECT_THAT(winners({"--port", "/lo*"}).err,
              testing::HasSubstr("; /low is an output port: name an input port that"));
  EXPECT_THAT(winners({"--at", "00:00:02.6", "--json"}).out,
              testing::AllOf(testing::HasSubstr("\"winner\": \"/high\""),
                             testing::HasSubstr("\"cut_off\": false")));
  EXPECT_THAT(winners({"--at", "00:00:03", "--json"}).out, testing::HasSubstr("\"cut_off\": true"));
  for (const char* time : {"00:00:09", "1970-01-02 00:00:02", "nine", "00:00:02.", "2"}) {
    const auto result = winners({"--at", time});
    EXPECT_EQ(result.exit_code, 2) << time;
    EXPECT_THAT(result.err, testing::HasSubstr("--at")) << time;
  }
}

// The recorder writes changes only.
TEST(RecordedWinners, SaysThatAPortIsIdleUntilSomebodyWins) {
  using Why = evidence::WinnerChange::Why;
  Incident incident;
  incident.add(evidence::WinnerChange{"/p", "/low", "", 2'000'000'000, Why::arrival, "/low", 1});
  incident.add(evidence::WinnerChange{"/q", "/low", "", 2'000'000'000, Why::model, "", 2});
  const auto result = arbiter_in_utc({"recording", "winners", incident.file(5'000'000'000)});
  EXPECT_EQ(result.out,
            "1970-01-01 00:00:00.005  /p  idle  for 2.000 s: it was so when the recording began\n"
            "1970-01-01 00:00:02.005  /p  /low  for 3.000 s, until the end of the recording: /low "
            "arrived\n"
            "1970-01-01 00:00:02.005  /q  /low  for 3.000 s, until the end of the recording: model "
            "2 came into force\n");
}

TEST(RecordedWinners, NamesTheModelThatCameAndWhoPutItInForce) {
  using Why = evidence::WinnerChange::Why;
  Incident incident;
  evidence::ModelChange change;
  change.time = change.seen = 2'000'000'000;
  change.generation = 2;
  change.name = "manual";
  change.how = "switch";
  change.by = "node teleop";
  incident.add(change);
  incident.add(evidence::WinnerChange{"/p", "/low", "", 2'000'000'000, Why::model, "", 2});
  EXPECT_THAT(arbiter({"recording", "winners", incident.file(5'000'000'000)}).out,
              testing::EndsWith(": model 2 \"manual\" came into force (switch, by node teleop)\n"));
}

// Of /low: a component that is there at the start dies, and another one opens the port, which the
// recorder sees after the first arrival.
TEST(RecordedWinners, SaysWhoseTheWinnerWas) {
  using Why = evidence::WinnerChange::Why;
  using What = evidence::PortChange::What;
  constexpr shm::Nanoseconds kSecond = 1'000'000'000;
  Incident incident(kOverride, {"/low", "/high"});
  const auto tell = [&](What what, const char* port, const char* node, std::int64_t pid,
                        shm::Nanoseconds seen, const char* host = "") {
    incident.add(evidence::PortChange{what, false, port, node, pid, "", seen, host});
  };
  const auto win = [&](const char* winner, shm::Nanoseconds time, Why why, const char* by) {
    incident.add(evidence::WinnerChange{"/p", winner, "/other", time, why, by, 1});
  };
  tell(What::open, "/low", "nav", 11, 1000);
  tell(What::open, "/high", "arbiter-link", 12, 1000, "base");
  win("/low", 1 * kSecond, Why::arrival, "/low");
  win("/high", 2 * kSecond, Why::arrival, "/high");
  tell(What::died, "/low", "nav", 11, 3 * kSecond);
  win("/low", 4 * kSecond, Why::expiry, "/high");
  win("", 5 * kSecond, Why::expiry, "/low");
  win("/low", 6 * kSecond, Why::arrival, "/low");
  win("/high", 6 * kSecond + 1, Why::arrival, "/high");
  tell(What::opened, "/low", "nav", 22, 6 * kSecond + 2);
  win("/low", 7 * kSecond, Why::expiry, "/high");
  tell(What::closed, "/low", "nav", 22, 8 * kSecond);
  tell(What::opened, "/low", "nav", 33, 8 * kSecond);
  win("/unknown", 9 * kSecond, Why::expiry, "/low");
  tell(What::closed, "/low", "nav", 33, 9 * kSecond + 1);
  win("/low", 9 * kSecond + 2, Why::arrival, "/low");  // of one that nobody saw open it
  const std::string file = incident.file(10 * kSecond);
  std::vector<std::string> words;
  std::istringstream lines(arbiter({"recording", "winners", file}).out);
  for (std::string line; std::getline(lines, line);) {
    words.push_back(
        line.substr(line.find("/p  ") + 4, line.find("  for ") - line.find("/p  ") - 4));
  }
  EXPECT_THAT(words, testing::ElementsAre(
                         "/low of nav (pid 11)", "/high from host base", "/low of nav (pid 11)",
                         "idle", "/low of nav (pid 22)", "/high from host base",
                         "/low of nav (pid 22), then of nav (pid 33)", "/unknown", "/low"));
  const auto found = nlohmann::json::parse(arbiter({"recording", "winners", "--json", file}).out);
  EXPECT_EQ(found[0]["components"],
            nlohmann::json::parse(R"([{"node": "nav", "pid": 11, "host": null}])"));
  EXPECT_EQ(found[1]["components"][0]["host"], "base");
  EXPECT_EQ(found[3]["components"], nlohmann::json::array());
  EXPECT_EQ(found[2]["died"], nullptr);
  EXPECT_EQ(found[3]["died"],
            nlohmann::json::parse(R"({"node": "nav", "pid": 11, "at_ns": 3000000000})"));
  EXPECT_THAT(arbiter({"recording", "winners", file, "--at", "1970-01-01 00:00:05.500"}).out,
              testing::EndsWith(": /low went inactive; nav (pid 11) had died 2.000 s before\n"));
}

// Each opens the port where another one is said to have died, whom nobody saw open it.
TEST(RecordedWinners, CountsComponentsOfWhichThereAreTooMany) {
  using Why = evidence::WinnerChange::Why;
  using What = evidence::PortChange::What;
  constexpr int kMany = 100;
  Incident incident(kOverride, {"/low"});
  incident.add(evidence::WinnerChange{"/all", "/low", "/other", 1000, Why::arrival, "/low", 1});
  for (int i = 0; i < kMany; ++i) {
    const shm::Nanoseconds time = 2000 + 10 * i;
    const std::string node = "nav" + std::string(5000, 'x');
    incident.add(evidence::PortChange{What::opened, false, "/low", node, 10 + i, "", time});
    incident.add(evidence::PortChange{What::died, false, "/low", "nav", 7, "", time + 1});
    incident.add(evidence::WinnerChange{"/p", "/low", "", time + 2, Why::arrival, "/low", 1});
    incident.add(evidence::WinnerChange{"/p", "", "/low", time + 4, Why::expiry, "/low", 1});
  }
  const std::string file = incident.file(2000 + 10 * kMany);
  const auto out = arbiter({"recording", "winners", file}).out;
  EXPECT_LT(out.size(), kMany * 1000u) << "each names the one that had the port open then";
  EXPECT_THAT(out, testing::ContainsRegex("/all  /low of nav.*, and 192 others  for "));
  EXPECT_THAT(out, testing::HasSubstr("xx (pid 109)  for 0.000 s: /low arrived\n"));
  EXPECT_THAT(out, testing::HasSubstr("; nav (pid 7) had died 0.000 s before\n"));
  const auto found = nlohmann::json::parse(arbiter({"recording", "winners", "--json", file}).out);
  EXPECT_THAT(found[0]["components"], testing::SizeIs(8));
  EXPECT_EQ(found[0]["other_components"], 192);
  EXPECT_THAT(found.back()["components"], testing::SizeIs(0));
  const auto& last = found[found.size() - 2];
  EXPECT_THAT(last["components"], testing::SizeIs(1));
  EXPECT_EQ(last["components"][0]["pid"], 109);
  EXPECT_FALSE(last.contains("other_components"));
}

TEST(RecordedWinners, DoNotTakeWhatWasMissedForSilence) {
  using Why = evidence::WinnerChange::Why;
  Incident incident;
  incident.arrive("/low", 1100, 1101, Incident::Fate::accepted);
  incident.add(evidence::WinnerChange{"/p", "/low", "", 1100, Why::arrival, "/low", 1});
  incident.add(evidence::WinnerChange{"/p", "", "/low", 1600, Why::expiry, "/low", 1});
  incident.add(evidence::Missed{"/low", 1100, 2000, 9, 0, evidence::Missed::Why::overtaken, ""});
  incident.state("/low", 2000, 2001, shm::arrival(2000, 500), evidence::SourceState::Why::gap, 9);
  incident.add(evidence::WinnerChange{"/p", "/low", "", 2000, Why::state, "/low", 1});
  incident.add(evidence::WinnerChange{"/p", "", "/low", 2500, Why::expiry, "/low", 1});
  const std::string file = incident.file(3000);
  const auto result = arbiter({"recording", "winners", file});
  EXPECT_THAT(result.out,
              testing::ContainsRegex("idle .*: /low went inactive, unless it arrived in what was "
                                     "missed\n.*: noticed late: what /low did from 1970-01-01 "
                                     "[0-9:.]* on was missed, so it may have begun since then\n"
                                     ".*: /low went inactive\n"));
  EXPECT_THAT(result.err, testing::HasSubstr("missed 9 events: who commanded is uncertain in 1 "
                                             "gap from "));
  const auto found = nlohmann::json::parse(arbiter({"recording", "winners", "--json", file}).out);
  EXPECT_EQ(found[1]["is_in_gap"], false);
  EXPECT_EQ(found[2]["is_in_gap"], true);
  EXPECT_EQ(found[2]["earliest_ns"], nullptr);
  EXPECT_EQ(found[3]["earliest_ns"], 1100);
}

TEST(RecordedWinners, SaysThatNobodyHasWon) {
  Incident incident;
  EXPECT_EQ(arbiter({"recording", "winners", incident.file()}).out,
            "nobody won, at any input port\n");
}

TEST(Export, ReplacesAFileIfItIsToldTo) {
  const TemporaryDirectory directory;
  Incident incident;
  const std::string there = directory.write("there.csv", "mine");
  EXPECT_EQ(arbiter({"recording", "export", incident.file(), "--csv", there}).exit_code, 2);
  EXPECT_EQ(content_of(there), "mine");
  EXPECT_EQ(arbiter({"recording", "export", incident.file(), "--csv", there, "--force"}).exit_code,
            0);
  EXPECT_EQ(content_of(there), "t_ns,source,destination,decision,winner\n");
}

TEST(Export, SaysWhatATraceCannotSay) {
  const TemporaryDirectory directory;
  Incident incident;
  incident.arrive("/low", 1100, 1101, Incident::Fate::accepted);
  EXPECT_EQ(arbiter({"recording", "export", incident.file(), "--trace", "/dev/null"}).err, "");
  incident.add(evidence::Start{1250, "test", {}, "none"});
  incident.put_in_force(kOverride, 1, 1200);
  const std::string file = incident.file();
  EXPECT_EQ(arbiter({"recording", "export", file, "--trace", "/dev/null"}).err,
            "arbiter: warning: a daemon came that knew nothing of what was active, which a trace "
            "cannot say: in it each activity goes on until its T is over\n");
  EXPECT_EQ(arbiter({"recording", "export", file, "--csv", "/dev/null"}).err, "");
}

TEST(Export, LeavesNoTraceWhereTheOtherFileCannotBeWritten) {
  const TemporaryDirectory directory;
  Incident incident;
  const std::string trace = directory.file("trace.csv");
  EXPECT_EQ(arbiter({"recording", "export", incident.file(), "--trace", trace, "--csv",
                     directory.file("no-such/decisions.csv")})
                .exit_code,
            2);
  EXPECT_FALSE(std::filesystem::exists(trace));
}

// Nine pigeons in eight holes: to find out that there is no room takes more steps than the least
// effort has.
std::string hard_model() {
  std::string rule = "true";
  const auto sits = [](int pigeon, int hole) {
    return "/x" + std::to_string(pigeon) + '_' + std::to_string(hole);
  };
  for (int pigeon = 0; pigeon < 9; ++pigeon) {
    rule += " and (false";
    for (int hole = 0; hole < 8; ++hole) rule += " or " + sits(pigeon, hole);
    rule += ")";
    for (int hole = 0; hole < 8; ++hole) {
      for (int other = 0; other < pigeon; ++other) {
        rule += " and not (" + sits(pigeon, hole) + " and " + sits(other, hole) + ")";
      }
    }
  }
  return "<behaviors timeout='500ns'><arbiter at='/p'><select from='/low'>" + rule +
         "</select></arbiter></behaviors>";
}

TEST(Export, ProvesModelsWithTheEffortThatItIsGiven) {
  Incident incident(hard_model(), {"/low"});
  incident.arrive("/low", 1100, 1101, Incident::Fate::accepted);
  const std::string file = incident.file();
  const auto result = [&](const char* effort) {
    return arbiter({"recording", "export", file, "--csv", "/dev/null", "--effort", effort});
  };
  EXPECT_EQ(result("1").exit_code, 0) << result("1").err;
  EXPECT_EQ(result("0.001").exit_code, 1);
  EXPECT_THAT(result("0.001").err, testing::HasSubstr("allow more steps with --effort"));
}

TEST(Export, NeedsToKnowWhat) {
  Incident incident;
  EXPECT_EQ(arbiter({"recording", "export", incident.file()}).exit_code, 2);
}

}  // namespace
}  // namespace arbiter::test
