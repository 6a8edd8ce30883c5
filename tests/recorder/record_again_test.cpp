// A recording that goes on behind a daemon with memory of its own.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <string>
#include <vector>

#include <arbiter/arbiter.hpp>
#include <nlohmann/json.hpp>

#include "tests/client/component.hpp"
#include "tests/recorder/recording.hpp"
#include "tests/support/await.hpp"

namespace arbiter::test {
namespace {

using evidence::Arrival;
using nlohmann::json;
using testing::HasSubstr;
using testing::Not;

TEST(Record, BeginsAgainWhereADaemonKnowsNothing) {
  Daemon daemon(kOverrideModel);
  Recording recording(daemon);
  daemon.kill();
  daemon.lose_state();
  daemon.restart();
  recording.see("recording starts again");
  await([&] { return recording.records<evidence::Start>().size() >= 2; });
  Node node("test");
  auto low = node.output_port<int>("/low");
  auto in = node.input_port<int>("/p");
  while (recording.records<Arrival>().empty()) {  // opening waits for the tap, but not for ever
    low.publish(1);
  }
  EXPECT_EQ(recording.end(), 0) << recording.error();
  const json result = recording.simulate();
  EXPECT_EQ(result["equal"], recording.records<Arrival>().size()) << result.dump(2);
}

// It has the start, and what it lacks: the end of the file says until when that holds.
TEST(Record, BeginsAgainWhereTheNewDaemonLetsItTapNothing) {
  const TemporaryDirectory files;
  const std::string policy = files.write("policy", "allow everyone all\n");
  Daemon daemon(kLasting, {.arguments = {"--policy", policy}});
  Recording recording(daemon);
  daemon.kill();
  daemon.lose_state();
  files.write("policy", "deny everyone tap *\nallow everyone all\n");
  daemon.restart();
  recording.see("cannot record /high and /low: ");
  await([&] { return recording.records<evidence::Start>().size() == 2; });
  EXPECT_EQ(recording.end(), 0) << recording.error();
  std::vector<std::string> refused;
  for (const auto& missed : recording.records<evidence::Missed>()) {
    if (missed.why == evidence::Missed::Why::refused) refused.push_back(missed.source);
  }
  EXPECT_EQ(refused, (std::vector<std::string>{"/high", "/low"}));
}

TEST(Record, SaysOnceWhyItCannotBeginAgain) {
  const TemporaryDirectory files;
  const std::string policy = files.write("policy", "allow everyone all\n");
  Daemon daemon(kLasting, {.arguments = {"--policy", policy}});
  Recording recording(daemon);
  daemon.kill();
  daemon.lose_state();
  files.write("policy", "deny everyone observe\nallow everyone all\n");
  daemon.restart();
  const std::string refusal = "; it is tried again: ";
  recording.see(refusal);
  files.write("policy", "allow everyone all\n");
  daemon.hang_up();
  await([&] { return recording.records<evidence::Start>().size() == 2; });
  EXPECT_EQ(recording.end(), 0) << recording.error();
  const std::string said = recording.error();
  EXPECT_EQ(said.find(refusal), said.rfind(refusal)) << said;
}

// The daemon cannot tell the publisher of a tap that has not come back.
TEST(Record, SaysThatItMissedWhatCameBesideADaemonThatDidNotKnowItsTaps) {
  Daemon daemon(kLasting);
  Node node("test");
  auto in = node.input_port<int>("/p");  // with which it hands the memory back
  Recording recording(daemon);
  recording.process().stop();
  daemon.kill();
  daemon.restart();
  auto low = node.output_port<int>("/low");
  low.publish(1);
  recording.process().resume();
  recording.see("a daemon is there again");
  await([&] { return daemon.taps_of("/low") == 1; });
  low.publish(2);
  EXPECT_EQ(recording.end(), 0) << recording.error();
  const auto arrivals = recording.records<Arrival>();
  ASSERT_EQ(arrivals.size(), 1u);
  const auto missed = recording.records<evidence::Missed>();
  ASSERT_EQ(missed.size(), 1u);
  EXPECT_EQ(missed[0].source, "/low");
  EXPECT_EQ(missed[0].events, 1u);
  EXPECT_LT(missed[0].from, arrivals[0].time);
  const auto shown = arbiter({"recording", "winners", "--json", recording.file()});
  const json winners = json::parse(shown.out);
  ASSERT_FALSE(winners.empty());
  EXPECT_EQ(winners.back()["winner"], "/low");
  EXPECT_LT(winners.back()["from_ns"], arrivals[0].time);
  EXPECT_EQ(winners.back()["earliest_ns"], missed[0].from);
}

// What they do from then on, who obeys them does; and nothing tells the recorder of it.
TEST(Record, SaysOfWhomItCannotRecordBehindADaemonThatDoesNotKnowThem) {
  Daemon daemon(kOverrideModel);
  Node node("nav");
  auto low = node.output_port<int>("/low");
  auto other = node.output_port<int>("/other");
  Recording recording(daemon, {"--port", "/p"});
  low.publish(1);
  daemon.kill();
  daemon.lose_state();
  daemon.restart();
  recording.see("cannot record /low of component nav (pid " + std::to_string(getpid()) +
                "): it goes on by the memory of a daemon before, and this one does not know it; "
                "start it again\n");
  EXPECT_EQ(recording.end(), 0) << recording.error();
  EXPECT_THAT(recording.error(), Not(HasSubstr("/other")));
  const auto missed = recording.records<evidence::Missed>();
  ASSERT_EQ(missed.size(), 1u) << "once, however often it is seen";
  EXPECT_EQ(missed[0].source, "/low");
  EXPECT_EQ(missed[0].why, evidence::Missed::Why::stranger);
  const auto starts = recording.records<evidence::Start>();
  ASSERT_EQ(starts.size(), 2u);
  EXPECT_LE(missed[0].from, starts[1].time);
  EXPECT_GT(missed[0].from, starts[0].time);
  const auto info = arbiter({"recording", "info", recording.file()});
  EXPECT_THAT(info.out, HasSubstr("\nsources that were not recorded, at least for a while\n"
                                  "  /low: of component nav (pid "));
  const auto about = json::parse(arbiter({"recording", "info", "--json", recording.file()}).out);
  ASSERT_EQ(about["unrecorded"].size(), 1u);
  EXPECT_EQ(about["unrecorded"][0]["source"], "/low");
  EXPECT_EQ(about["unrecorded"][0]["why"], "stranger");
}

}  // namespace
}  // namespace arbiter::test
