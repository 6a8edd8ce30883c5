// `arbiter simulate --recording`: what was decided live is decided again.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <thread>

#include <arbiter/arbiter.hpp>

#include "evidence/record_writer.hpp"
#include "tests/client/component.hpp"
#include "tests/client/samples.hpp"
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

TEST(SimulateRecording, ReproducesWhatPublishersDecidedAtOnce) {
  Daemon daemon(kBusyModel);
  Node node("test");
  auto p = node.input_port<Number>("/p");
  auto q = node.input_port<Number>("/q");
  Recording recording(daemon);
  const auto publish = [](const std::string& name, int rounds) {
    Node own("publisher");
    auto port = own.output_port<Number>(name);
    for (int i = 0; i < rounds; ++i) {
      port.publish(Number{i});
      if (i % 7 == 3) port.deactivate();
      if (i % 3 == 0) std::this_thread::yield();
      if (i % 50 == 0) ::usleep(200);  // a rate that a recorder can follow
    }
  };
  std::vector<std::thread> threads;
  for (const char* name : {"/a", "/b"}) threads.emplace_back(publish, name, 4000);
  Component component("other");
  component.tell("output /c");
  for (int i = 0; i < 2000; ++i) component.tell(i % 5 == 2 ? "deactivate /c" : "publish /c 1");
  for (auto& thread : threads) thread.join();
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
