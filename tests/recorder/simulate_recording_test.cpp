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
#include "tests/recorder/in_zone.hpp"
#include "tests/recorder/overridden.hpp"
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

// What matters first; and a thousand arrivals that change alike are one line.
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
  EXPECT_THAT(arbiter_in_utc({"simulate", "--recording", file}).out,
              testing::EndsWith("nothing to compare: what arrived was not connected to an open "
                                "input port\n"));
  const TemporaryDirectory directory;
  const std::string other = directory.write("other.xml", kOverride);
  EXPECT_THAT(arbiter_in_utc({"simulate", other, "--recording", file}).out,
              HasSubstr("  /low #1 at /p: delivered instead of not connected\n"));
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
  const auto why = arbiter_in_utc({"simulate", "--recording", file, "--why=/p"});
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
      arbiter_in_utc({"simulate", "--recording", file, "--why=/p", "--at", "00:00:00.005002"});
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
