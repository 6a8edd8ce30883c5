// `arbiter simulate --recording`: what was decided live is decided again.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <functional>
#include <thread>
#include <vector>

#include <arbiter/arbiter.hpp>

#include "evidence/record_writer.hpp"
#include "tests/client/component.hpp"
#include "tests/client/samples.hpp"
#include "tests/evidence/incident.hpp"
#include "tests/recorder/recording.hpp"

namespace arbiter::test {
namespace {

using nlohmann::json;
using testing::HasSubstr;

// Publishers in processes and threads of their own, as fast as they can, that take over from each
// other all the time.
const std::string kBusyModel = R"(<behaviors timeout="1ms">
  <arbiter at="/p">
    <select from="/a">not /b and not /c</select>
    <select from="/b">not /c</select>
    <select from="/c">/a or not /b</select>
  </arbiter>
  <arbiter at="/q"><select from="/a">/b xor /c</select></arbiter>
</behaviors>
)";

// To stop: there is much to compare, or a difference already.
bool has_enough(const json& result) {
  return !result.is_null() &&
         (result["different"] > 0 || (result["equal"] > 1000 && result["decisions"] > 5000));
}

TEST(SimulateRecording, ReproducesWhatPublishersDecidedAtOnce) {
  Daemon daemon(kBusyModel);
  Node node("test");
  auto p = node.input_port<Number>("/p");
  auto q = node.input_port<Number>("/q");
  Recording recording(daemon);
  std::vector<OutputPort<Number>> ports;
  std::vector<Node> publishers;
  for (const char* name : {"/a", "/b"}) {
    ports.push_back(publishers.emplace_back("publisher").output_port<Number>(name));
  }
  Component component("other");
  component.tell("output /c");
  const auto publish = [](OutputPort<Number>& port) {
    for (int i = 0; i < 4000; ++i) {
      port.publish(Number{i});
      if (i % 7 == 3) port.deactivate();
      if (i % 3 == 0) std::this_thread::yield();
      if (i % 50 == 0) ::usleep(200);  // a rate that a recorder can follow
    }
  };
  // Again where the recorder could not follow for a while: of what it missed, nothing is decided.
  for (json so_far; !has_enough(so_far); so_far = recording.simulate()) {
    std::vector<std::thread> threads;
    for (auto& port : ports) threads.emplace_back(publish, std::ref(port));
    for (int i = 0; i < 2000; ++i) component.tell(i % 5 == 2 ? "deactivate /c" : "publish /c 1");
    for (auto& thread : threads) thread.join();
  }
  EXPECT_EQ(recording.end(), 0) << recording.error();
  const json result = recording.simulate();
  EXPECT_EQ(result["different"], 0) << result.dump(2);
  EXPECT_GT(result["equal"], 1000) << result.dump(2);
  EXPECT_GT(result["decisions"], 5000) << result.dump(2);
  RecordProperty("result", result.dump());
}

// The same file, but one fate is another: as if the live system had decided wrongly.
TEST(SimulateRecording, SaysAtTheFirstThatDiffers) {
  Daemon daemon(kLasting);
  Node node("test");
  auto low = node.output_port<int>("/low");
  auto high = node.output_port<int>("/high");
  auto in = node.input_port<int>("/p");
  Recording recording(daemon);
  high.publish(2);
  recording.wait_for<evidence::Arrival>([](const auto&) { return true; });
  low.publish(3);
  EXPECT_EQ(recording.end(), 0);
  const std::string forged = daemon.directory() + "/forged.mcap";
  evidence::RecordWriter writer(forged, {}, {"program", "test", "", "", 0});
  evidence::read_recording(recording.file(), evidence::Payloads::read,
                           [&](evidence::Record&& record) {
                             auto* arrival = std::get_if<evidence::Arrival>(&record);
                             if (arrival != nullptr && arrival->context->source == "/low") {
                               std::swap(arrival->masks.accepted, arrival->masks.discarded);
                             }
                             writer.write(record);
                           });
  writer.close();
  const auto result = arbiter({"simulate", "--recording", forged});
  EXPECT_EQ(result.exit_code, 1);
  EXPECT_THAT(result.out, HasSubstr("2 decisions: 1 equal, 0 overlapped, 0 blind, 0 behind a gap, "
                                    "1 different\n"));
  EXPECT_THAT(result.out,
              HasSubstr("/low #1 at /p was delivered; the model discards it; by the recording: "
                        "/high active\n"));
}

TEST(SimulateRecording, ShowsWhatAnotherModelWouldHaveDone) {
  Daemon daemon(kLasting);
  Node node("test");
  auto low = node.output_port<int>("/low");
  auto high = node.output_port<int>("/high");
  auto in = node.input_port<int>("/p");
  Recording recording(daemon);
  low.publish(1);
  recording.wait_for<evidence::Arrival>([](const auto&) { return true; });
  high.publish(2);
  recording.wait_for<evidence::Arrival>(
      [](const auto& each) { return each.context->source == "/high"; });
  low.publish(3);
  EXPECT_EQ(recording.end(), 0);
  const std::string other = daemon.directory() + "/other.xml";
  std::ofstream(other) << R"(<behaviors timeout="1000s">
    <behavior name="Low"><config at="/p">/low</config><inhibition>High</inhibition></behavior>
    <behavior name="High"><config at="/p">/high</config></behavior></behaviors>)";
  const json result = recording.simulate({"--model", other});
  ASSERT_EQ(result["changed"].size(), 2u) << result.dump(2);
  EXPECT_EQ(result["changed"][0]["source"], "/high");
  EXPECT_EQ(result["changed"][0]["other"], "discarded");
  EXPECT_EQ(result["changed"][1]["source"], "/low");
  ASSERT_GE(result["winner_intervals"].size(), 1u);
  EXPECT_EQ(result["winner_intervals"][0]["recorded"], "/high");
  EXPECT_EQ(result["winner_intervals"][0]["other"], "/low");
  const json same = recording.simulate({"--model", daemon.directory() + "/model.xml"});
  EXPECT_EQ(same["changed"].size(), 0u);
  EXPECT_EQ(same["winner_intervals"].size(), 0u);
}

// From 1000 on; the first arrival at 1100.
std::string overridden_for_a_while(Incident& incident) {
  incident.state("/high", 900, 995, shm::arrival(900, 150));  // until 1050
  incident.arrive("/low", 1100, 1101, Incident::Fate::accepted);
  incident.arrive("/high", 1200, 1201, Incident::Fate::accepted);
  for (const int time : {1300, 1310, 1320, 1330}) {
    incident.arrive("/low", time, time + 1, Incident::Fate::discarded);
  }
  incident.deactivate("/high", 1400, 1401);
  incident.arrive("/low", 1410, 1411, Incident::Fate::accepted);
  return incident.file();
}

ProgramResult in_utc(std::vector<std::string> arguments) {
  arguments.insert(arguments.begin(), {"/usr/bin/env", "TZ=UTC", ARBITER_PROGRAMS "/arbiter"});
  return run_program(arguments);
}

// What matters first; and a thousand arrivals that change alike are one line.
TEST(SimulateRecording, SaysThatAForeignModelHasNoneOfThePorts) {
  Incident incident;
  incident.arrive("/low", 1100, 1101, Incident::Fate::accepted);
  const TemporaryDirectory directory;
  const std::string file = incident.file();
  const auto with = [&](const std::string& port) {
    const std::string model =
        directory.write("other.xml", "<behaviors><behavior name='X'><config at='" + port +
                                         "'>/low</config></behavior></behaviors>");
    return arbiter({"simulate", "--recording", file, "--model", model}).err;
  };
  EXPECT_THAT(with("/q"), HasSubstr("warning: the model has none of the input ports of the "
                                    "recording: /p\n"));
  EXPECT_EQ(with("/p"), "");
}

TEST(SimulateRecording, ShowsIntervalsFirstAndFoldsDecisionsThatChangeAlike) {
  const TemporaryDirectory directory;
  const std::string other = directory.write("other.xml", kReversed);
  Incident incident;
  const std::string file = overridden_for_a_while(incident);
  const auto result = arbiter({"simulate", "--recording", file, "--model", other});
  EXPECT_EQ(result.exit_code, 1) << result.err;
  EXPECT_EQ(result.out.substr(result.out.find('\n') + 1),
            "7 decisions: 2 the same, 5 changed, 0 uncertain\n"
            "the winner differs:\n"
            "  +0.000000100 s to +0.000000300 s  /p: /low instead of /high\n"
            "these decisions change:\n"
            "  +0.000000100 s  /high #1 at /p: discarded instead of delivered\n"
            "  +0.000000200 s to +0.000000230 s  /low, 4 arrivals (#2 to #5) at /p: delivered "
            "instead of discarded\n");
  const auto each = arbiter({"simulate", "--recording", file, "--model", other, "--each"});
  EXPECT_THAT(each.out, HasSubstr("  +0.000000210 s  /low #3 at /p: delivered instead of "
                                  "discarded\n"));
}

TEST(SimulateRecording, ShowsNoNegativeTimes) {
  const TemporaryDirectory directory;
  const std::string other = directory.write(
      "other.xml", R"(<behaviors timeout="500ns"><arbiter at="/p"><select from="/low"/></arbiter>
                      </behaviors>)");
  Incident incident;
  const std::string file = overridden_for_a_while(incident);
  const auto result = arbiter({"simulate", "--recording", file, "--model", other});
  EXPECT_THAT(result.out, HasSubstr("\n  0.000000100 s before the first arrival to 0.000000050 s "
                                    "before the first arrival  /p: nobody instead of /high\n"));
  EXPECT_EQ(result.out.find("-0."), std::string::npos) << result.out;
}

TEST(SimulateRecording, TellsWhyWinnersChangedAndArrivalsWereDiscarded) {
  const TemporaryDirectory directory;
  Incident incident;
  const std::string file = overridden_for_a_while(incident);
  const auto result = in_utc({"simulate", "--recording", file, "--why=/p"});
  EXPECT_EQ(result.exit_code, 0) << result.err;
  for (const char* line : {"1970-01-01 00:00:00.005 (0.000000100 s before the first arrival)  /p  "
                           "/high wins as this begins\n",
                           "\n1970-01-01 00:00:00.005 (0.000000050 s before the first arrival)  /p "
                           " /high -> idle  because /high went inactive",
                           "\n1970-01-01 00:00:00.005 (+0.000000000 s)  /p  idle -> /low  because "
                           "/low became active\n",
                           "\n1970-01-01 00:00:00.005 (+0.000000100 s)  /p  /low -> /high  because "
                           "/high became active; /low is inhibited by "
                           "behaviour \"High\" (model.xml:",
                           "\n1970-01-01 00:00:00.005 (+0.000000200 s)  /p  /low discarded: "
                           "inhibited by behaviour \"High\" (model.xml:",
                           "  /p  /low was discarded 3 more times for that reason, until "
                           "1970-01-01 00:00:00.005 (+0.000000230 s)\n",
                           "\n1970-01-01 00:00:00.005 (+0.000000300 s)  /p  /high -> /low  because "
                           "/high was deactivated"}) {
    EXPECT_THAT("\n" + result.out, HasSubstr(line));
  }
  const std::string other = directory.write("other.xml", kReversed);
  const auto under = arbiter({"simulate", other, "--recording", file, "--why", "--json"});
  EXPECT_EQ(under.exit_code, 0) << under.err;
  EXPECT_THAT(under.out, HasSubstr(R"("event":"discarded")"));
  EXPECT_THAT(under.out, HasSubstr(R"("inhibitor":{"kind":"behaviour","name":"Low")"));
  EXPECT_EQ(arbiter({"simulate", "--recording", file, "--why=/q"}).exit_code, 1);
}

// What held as it began, and what happened then. The wall clock is 5 ms ahead.
TEST(SimulateRecording, TellsWhyAtATimeOfDay) {
  constexpr shm::Nanoseconds kMs = 1'000'000;
  std::string model = kOverride;
  Incident incident(model.replace(model.find("500ns"), 5, "500ms"));
  incident.arrive("/low", 1000 * kMs, 1000 * kMs, Incident::Fate::accepted, 500 * kMs);
  incident.arrive("/high", 2000 * kMs, 2000 * kMs, Incident::Fate::accepted, 500 * kMs);
  incident.arrive("/low", 2200 * kMs, 2200 * kMs, Incident::Fate::discarded, 500 * kMs);
  const std::string file = incident.file(3000 * kMs);
  const auto at = [&](const std::string& time, const std::string& more = "--why=/p") {
    return in_utc({"simulate", "--recording", file, more, "--at", time});
  };
  const std::string low =
      "1970-01-01 00:00:01.005 (+0.000000000 s)  /p  idle -> /low  because /low became active\n";
  const std::string idle =
      "1970-01-01 00:00:01.505 (+0.500000000 s)  /p  /low -> idle  because /low went inactive, 500 "
      "ms after its last arrival\n";
  EXPECT_EQ(at("00:00:01.250").out, low);
  EXPECT_EQ(at("00:00:01").out, low + idle);
  EXPECT_EQ(at("00:00:01.600").out, idle);
  EXPECT_EQ(at("00:00:00").out, "nobody won at 00:00:00, and nothing happened\n");
  const auto second = at("00:00:02");
  EXPECT_EQ(second.exit_code, 0) << second.err;
  EXPECT_THAT(
      second.out,
      testing::StartsWith(idle + "1970-01-01 00:00:02.005 (+1.000000000 s)  /p  idle -> /high "));
  EXPECT_THAT(second.out,
              HasSubstr("\n1970-01-01 00:00:02.205 (+1.200000000 s)  /p  /low discarded: "));
  EXPECT_THAT(second.out,
              HasSubstr("\n1970-01-01 00:00:02.505 (+1.500000000 s)  /p  /high -> /low "));
  EXPECT_THAT(second.out,
              HasSubstr("\n1970-01-01 00:00:02.705 (+1.700000000 s)  /p  /low -> idle "));
  EXPECT_EQ(std::count(second.out.begin(), second.out.end(), '\n'), 5) << second.out;
  EXPECT_THAT(at("00:00:02.600").out, testing::StartsWith("1970-01-01 00:00:02.505 (+1.5"));
  const auto lines =
      in_utc({"simulate", "--recording", file, "--why", "--json", "--at", "00:00:02.6"});
  EXPECT_EQ(json::parse(lines.out)["time"], "1970-01-01 00:00:02.505");
  EXPECT_EQ(at("00:00:09").exit_code, 2) << "not in the recording";
  EXPECT_EQ(at("00:00:02", "--json").exit_code, 2) << "without --why";
}

// Each by what it says; what was active stays so.
TEST(SimulateRecording, TellsWhyByTheModelThatWasInForce) {
  Incident incident;
  incident.arrive("/low", 1100, 1101, Incident::Fate::accepted);
  incident.arrive("/high", 1200, 1201, Incident::Fate::accepted);
  incident.put_in_force(kReversed, 2, 1300);
  incident.arrive("/high", 1310, 1311, Incident::Fate::discarded);
  const auto result = in_utc({"simulate", "--recording", incident.file(), "--why"});
  EXPECT_EQ(result.exit_code, 0) << result.err;
  EXPECT_THAT(
      result.err,
      HasSubstr("arbiter: 1970-01-01 00:00:00.005 (+0.000000200 s), model 2 came into force\n"));
  EXPECT_THAT(
      result.out,
      HasSubstr("\n1970-01-01 00:00:00.005 (+0.000000200 s)  /p  /low wins as this begins\n"));
  EXPECT_THAT(
      result.out,
      HasSubstr("\n1970-01-01 00:00:00.005 (+0.000000210 s)  /p  /high discarded: inhibited by "));
}

// Nobody wins there by the new one: it does not connect who commanded.
TEST(SimulateRecording, TellsThatAModelEndsACommand) {
  Incident incident;
  incident.arrive("/low", 1100, 1101, Incident::Fate::accepted);
  evidence::ModelChange change;
  change.time = change.seen = 1300;
  change.generation = 2;
  change.name = "hands off";
  change.how = "switch";
  change.by = "root";
  change.has_texts = true;
  change.files = {
      {"off.xml", "<behaviors><arbiter at='/p'><select from='/high'/></arbiter></behaviors>"}};
  incident.add(change);
  incident.arrive("/low", 1310, 1311, Incident::Fate::none);
  const std::string file = incident.file(1400);
  const auto result = in_utc({"simulate", "--recording", file, "--why=/p"});
  EXPECT_THAT(result.out, testing::EndsWith("(+0.000000200 s)  /p  /low -> idle  because model 2 "
                                            "\"hands off\" came into force (switch, by root)\n"));
  const auto lines = in_utc({"simulate", "--recording", file, "--why", "--json"}).out;
  const json last = json::parse(lines.substr(lines.rfind('\n', lines.size() - 2) + 1));
  EXPECT_EQ(last["event"], "change");
  EXPECT_EQ(last["old"], "/low");
  EXPECT_TRUE(last["winner"].is_null());
  EXPECT_EQ(last["model"], 2);
}

TEST(SimulateRecording, SaysThatNothingThatArrivedWasConnected) {
  Incident incident("<behaviors><arbiter at='/p'><select from='/high'/></arbiter></behaviors>");
  evidence::PortChange open;
  open.what = evidence::PortChange::What::open;
  open.is_input = true;
  open.port = "/p";
  open.seen = 1000;
  incident.add(open);
  incident.arrive("/low", 1100, 1101, Incident::Fate::none);
  const std::string file = incident.file();
  EXPECT_THAT(in_utc({"simulate", "--recording", file}).out,
              testing::EndsWith("nothing to compare: what arrived was not connected to an open "
                                "input port\n"));
  const TemporaryDirectory directory;
  const std::string other = directory.write("other.xml", kOverride);
  EXPECT_THAT(in_utc({"simulate", other, "--recording", file}).out,
              HasSubstr("  /low #1 at /p: delivered instead of not connected\n"));
}

// The first model need not have the port.
TEST(SimulateRecording, TellsWhyAtAPortThatALaterModelHas) {
  Incident incident;
  incident.arrive("/low", 1100, 1101, Incident::Fate::accepted);
  incident.put_in_force("<behaviors><arbiter at='/q'><select from='/low'/></arbiter></behaviors>",
                        2, 1300);
  incident.arrive("/low", 1310, 1311, Incident::Fate::accepted);
  const auto result = in_utc({"simulate", "--recording", incident.file(), "--why=/q"});
  EXPECT_EQ(result.exit_code, 0) << result.err;
  EXPECT_THAT(result.err, HasSubstr("model 1 has no input port /q: what it decided is left out\n"));
  EXPECT_THAT(result.out, HasSubstr("  /q  /low wins as this begins\n"));
  EXPECT_THAT(arbiter({"simulate", "--recording", incident.file(), "--why=/low"}).err,
              HasSubstr("/low is an output port, connected to /q"));
}

// What lies between is not made up: neither by --why, nor silently by an export.
TEST(SimulateRecording, SaysWhereTheRecorderMissedSomething) {
  const TemporaryDirectory directory;
  Incident incident;
  incident.arrive("/low", 1100, 1101, Incident::Fate::accepted);
  incident.arrive("/high", 1200, 1201, Incident::Fate::accepted);
  incident.add(evidence::Missed{"/high", 0, 2400, 3, 2, evidence::Missed::Why::overtaken, ""});
  incident.state("/high", 2400, 2450, shm::arrival(2400, 500), evidence::SourceState::Why::gap, 3);
  incident.arrive("/low", 2500, 2501, Incident::Fate::discarded);
  incident.arrive("/low", 3000, 3001, Incident::Fate::accepted);
  const std::string file = incident.file();
  const char* const warning =
      "arbiter: the recorder missed 3 events and the payloads of 2 samples: statements about "
      "the time around the gaps may be wrong\n";
  const auto why = in_utc({"simulate", "--recording", file, "--why=/p"});
  EXPECT_EQ(why.exit_code, 0) << why.err;
  EXPECT_EQ(why.err, warning);
  for (const char* line :
       {"\n1970-01-01 00:00:00.005 (+0.000000100 s)  the recorder missed 3 events of /high from "
        "here until 1970-01-01 00:00:00.005 (+0.000001300 s): "
        "what depends on it is not known\n",
        "\n1970-01-01 00:00:00.005 (+0.000000600 s)  /p  /high -> idle  because /high went "
        "inactive, unless it arrived in "
        "what "
        "was missed\n",
        "\n1970-01-01 00:00:00.005 (+0.000001300 s)  /p  idle -> /high  because /high is active "
        "behind what was missed\n",
        "\n1970-01-01 00:00:00.005 (+0.000001800 s)  /p  /high -> /low  because /high went "
        "inactive, 0 us after its "
        "last "}) {
    EXPECT_THAT(why.out, HasSubstr(line));
  }
  // One moment within the gap: the gap, and who wins by what is known. Both began before.
  const auto moment =
      in_utc({"simulate", "--recording", file, "--why=/p", "--at", "00:00:00.005002"});
  EXPECT_THAT(
      moment.out,
      testing::ContainsRegex("^[^\n]* the recorder missed [^\n]*\n[^\n]* /high -> idle [^\n]*\n$"));
  const auto lines = arbiter({"simulate", "--recording", file, "--why", "--json"});
  EXPECT_THAT(lines.out, HasSubstr(R"({"event":"missed","events":3,"source":"/high",)"));
  EXPECT_THAT(lines.out, HasSubstr(R"("is_in_gap":true)"));
  const auto exported =
      arbiter({"recording", "export", file, "--trace", directory.file("trace.csv")});
  EXPECT_EQ(exported.exit_code, 0);
  EXPECT_EQ(exported.err, warning);
  EXPECT_THAT(arbiter({"simulate", "--recording", file}).out,
              HasSubstr("\nthe recorder missed 3 events and the payloads of 2 samples\n"));
  const auto info = arbiter({"recording", "info", file}).out;
  EXPECT_THAT(info, HasSubstr("missed        by the recorder: 3 events and the payloads of 2"));
}

TEST(SimulateRecording, NeedsARecording) {
  Daemon daemon(kOverrideModel);
  auto result = arbiter({"simulate", "--recording", daemon.directory() + "/none.mcap"});
  EXPECT_NE(result.exit_code, 0);
  result = arbiter({"simulate", "--recording", daemon.directory() + "/model.xml"});
  EXPECT_NE(result.exit_code, 0);
  EXPECT_THAT(result.err, HasSubstr("model.xml"));
}

}  // namespace
}  // namespace arbiter::test
