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
