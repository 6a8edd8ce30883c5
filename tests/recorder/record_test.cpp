// What `arbiter record` writes down.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <set>

#include <arbiter/arbiter.hpp>

#include "evidence/recorded.hpp"
#include "shm/clock.hpp"
#include "tests/client/component.hpp"
#include "tests/recorder/recording.hpp"
#include "tests/support/await.hpp"

namespace arbiter::test {
namespace {

using evidence::Arrival;
using evidence::WinnerChange;
using nlohmann::json;
using testing::HasSubstr;

const std::string kReversedModel = R"(<behaviors>
  <behavior name="Low"><config at="/p">/low</config><inhibition>High</inhibition></behavior>
  <behavior name="High"><config at="/p">/high</config></behavior>
</behaviors>
)";

std::set<std::string> tapped(const Recording& recording) {
  std::set<std::string> sources;
  for (const auto& state : recording.records<evidence::SourceState>()) {
    sources.insert(state.context->source);
  }
  return sources;
}

TEST(Record, HasEachArrivalWithItsPayloadAndItsFates) {
  Daemon daemon(kLasting);
  Node node("test");
  auto low = node.output_port<int>("/low");
  auto high = node.output_port<int>("/high");
  auto in = node.input_port<int>("/p");
  Recording recording(daemon, {"--payloads", "/low*"});
  low.publish(7);
  high.publish(8);
  low.publish(9);
  high.signal();
  high.deactivate();
  EXPECT_EQ(recording.end(), 0) << recording.error();
  EXPECT_THAT(recording.output(), HasSubstr("4 arrivals of 2 sources and 3 changes of winner in "));
  auto arrivals = recording.records<Arrival>();
  ASSERT_EQ(arrivals.size(), 4u);
  EXPECT_EQ(arrivals[0].context->source, "/low");
  EXPECT_EQ(arrivals[0].masks.accepted, 1u);
  EXPECT_EQ(arrivals[0].context->destinations, (std::vector<std::string>{"/p"}));
  int value = 0;
  ASSERT_TRUE(arrivals[2].payload && arrivals[2].payload->size() == sizeof value);
  std::memcpy(&value, arrivals[2].payload->data(), sizeof value);
  EXPECT_EQ(value, 9);
  EXPECT_EQ(arrivals[2].masks.discarded, 1u);
  EXPECT_EQ(arrivals[2].sequence, 2u);
  EXPECT_FALSE(arrivals[1].payload);
  EXPECT_FALSE(arrivals[3].is_sample);
  EXPECT_EQ(recording.records<evidence::Deactivation>().size(), 1u);
  std::vector<std::string> winners;
  for (const auto& each : recording.records<WinnerChange>()) {
    winners.push_back(each.winner + ' ' + std::string(name_of(each.why)));
  }
  EXPECT_EQ(winners,
            (std::vector<std::string>{"/low arrival", "/high arrival", "/low deactivation"}));
}

TEST(Record, BeginsWithTheStateOfAllActivitiesAndTheModel) {
  Daemon daemon(kLasting);
  Node node("test");
  auto high = node.output_port<int>("/high");
  auto low = node.output_port<int>("/low");
  auto in = node.input_port<int>("/p");
  high.signal();
  Recording recording(daemon);
  low.publish(1);
  EXPECT_EQ(recording.end(), 0) << recording.error();
  const auto models = recording.records<evidence::ModelChange>();
  ASSERT_EQ(models.size(), 1u);
  EXPECT_EQ(models[0].files.at(0).text, kLasting);
  const auto winners = recording.records<WinnerChange>();
  ASSERT_FALSE(winners.empty());
  EXPECT_EQ(winners[0].winner, "/high");
  EXPECT_EQ(winners[0].why, WinnerChange::Why::start);
  const json result = recording.simulate();
  EXPECT_EQ(result["equal"], 1) << result.dump(2);
  EXPECT_EQ(result["different"], 0);
}

TEST(Record, OfAPortHasEverySourceThatItsRulesRead) {
  Daemon daemon(R"(<behaviors>
    <arbiter at="/p"><select from="/a">not /read</select></arbiter>
    <arbiter at="/q"><select from="/b"/></arbiter></behaviors>)");
  Node node("test");
  auto other = node.output_port<int>("/unrelated");
  Recording recording(daemon, {"--port", "/p*"});
  EXPECT_EQ(recording.end(), 0) << recording.error();
  EXPECT_EQ(tapped(recording), (std::set<std::string>{"/a", "/read"}));
}

TEST(Record, TakesUpSourcesOfANewModelAndNewPorts) {
  Daemon daemon(kOverrideModel);
  Recording recording(daemon, {"--port", "/p"});
  daemon.load(R"(<behaviors><arbiter at="/p"><select from="/new">not /low</select></arbiter>
                 </behaviors>)");
  recording.wait_for<evidence::SourceState>(
      [](const auto& state) { return state.context->source == "/new"; });
  Node node("test");
  auto fresh = node.output_port<int>("/new");
  auto in = node.input_port<int>("/p");
  // Opening waits for the tap, but not for ever. Slowly: a recorder that stands still misses none.
  for (; recording.records<Arrival>().empty(); ::poll(nullptr, 0, 5)) fresh.publish(1);
  EXPECT_EQ(recording.end(SIGTERM), 0) << recording.error();
  EXPECT_EQ(recording.records<evidence::ModelChange>().size(), 2u);
  const auto arrivals = recording.records<Arrival>();
  ASSERT_FALSE(arrivals.empty());
  EXPECT_EQ(arrivals.back().sequence - arrivals.front().sequence + 1, arrivals.size());
  EXPECT_EQ(recording.simulate()["equal"], arrivals.size());
}

TEST(Record, SeesPortsComeAndGo) {
  Daemon daemon(kOverrideModel);
  Recording recording(daemon);
  {
    Node node("test");
    auto low = node.output_port<int>("/low");
    low.publish(1);
    recording.wait_for<evidence::PortChange>([](const auto& port) {
      return port.port == "/low" && port.what == evidence::PortChange::What::opened &&
             port.pid == getpid();
    });
  }
  recording.wait_for<evidence::PortChange>([](const auto& port) {
    return port.port == "/low" && port.what == evidence::PortChange::What::closed;
  });
  EXPECT_EQ(recording.end(), 0);
}

TEST(Record, SeesWhatAnOperatorDeactivates) {
  Daemon daemon(R"(<behaviors timeout="forever">
    <arbiter at="/p"><select from="/a"/></arbiter></behaviors>)");
  {
    Node node("test");
    node.output_port<int>("/a").signal();
  }
  Recording recording(daemon);
  EXPECT_EQ(arbiter({"deactivate", "/a"}).exit_code, 0);
  recording.wait_for<evidence::SourceState>(
      [](const auto& state) { return shm::is_deactivation(state.word); });
  EXPECT_EQ(recording.end(), 0);
  const auto change = recording.records<WinnerChange>().back();
  EXPECT_EQ(change.winner, "");
  EXPECT_EQ(change.why, WinnerChange::Why::deactivation);
  EXPECT_EQ(shm::deactivation(change.time), recording.records<evidence::SourceState>().back().word);
}

TEST(Record, SeesWhatAnOperatorDeactivatesLast) {
  Daemon daemon(R"(<behaviors timeout="forever">
    <arbiter at="/p"><select from="/a"/></arbiter></behaviors>)");
  {
    Node node("test");
    node.output_port<int>("/a").signal();
  }
  Recording recording(daemon, {"--period", "1s"});
  EXPECT_EQ(arbiter({"deactivate", "/a"}).exit_code, 0);
  EXPECT_EQ(recording.end(), 0);
  EXPECT_TRUE(shm::is_deactivation(recording.records<evidence::SourceState>().back().word));
}

// By whose activity the next one begins, nobody has missed anything; nor where the pages of sources
// have said what has happened long before taps tell of it.
TEST(Record, HasNoGapWhereASourceIsOpenedAgain) {
  const std::string forever = R"(<source port="/high" timeout="forever"/></behaviors>)";
  Daemon daemon(kLasting.substr(0, kLasting.find("</behaviors>")) + forever);
  Node node("test");
  auto in = node.input_port<int>("/p");
  auto low = node.output_port<int>("/low");
  Recording recording(daemon, {"--period", "100ms"});
  std::size_t arrivals = 0;
  for (const bool is_over : {false, true, false}) {
    {
      auto high = node.output_port<int>("/high");
      high.publish(1);
      if (is_over) high.deactivate();
    }
    low.publish(2);
    arrivals += 2;
    await([&] { return recording.records<Arrival>().size() == arrivals; }, 20);
  }
  EXPECT_EQ(recording.end(), 0) << recording.error();
  const json result = recording.simulate();
  EXPECT_EQ(result["decisions"], 6) << result.dump(2);
  EXPECT_EQ(result["behind_gap"], 0) << result.dump(2);
  EXPECT_EQ(result["different"], 0) << result.dump(2);
}

TEST(Record, SaysWhatItMissed) {
  Daemon daemon(kOverrideModel);
  Node node("test");
  auto low = node.output_port<int>("/low");
  auto in = node.input_port<int>("/p");
  Recording recording(daemon, {"--payloads", "all"});
  low.publish(0);
  recording.wait_for<Arrival>([](const auto&) { return true; });
  recording.process().stop();
  constexpr int kMany = 5000;  // a publisher keeps 1024 events
  for (int i = 0; i < kMany; ++i) low.publish(i);
  recording.process().resume();
  recording.wait_for<evidence::Missed>([](const auto& missed) { return missed.events != 0; });
  low.publish(1);
  EXPECT_EQ(recording.end(), 0) << recording.error();
  std::uint64_t lost = 0;
  std::uint64_t lost_samples = 0;
  for (const auto& missed : recording.records<evidence::Missed>()) {
    lost += missed.events;
    lost_samples += missed.samples;
  }
  const auto arrivals = recording.records<Arrival>();
  EXPECT_EQ(lost + arrivals.size(), kMany + 2u);
  const auto with = std::count_if(arrivals.begin(), arrivals.end(),
                                  [](const auto& each) { return each.payload.has_value(); });
  EXPECT_EQ(lost_samples + static_cast<std::size_t>(with), arrivals.size());
  EXPECT_THAT(recording.output(), HasSubstr("missed " + std::to_string(lost) + " events"));
  EXPECT_EQ(recording.simulate()["different"], 0);
}

TEST(Record, GoesOnWhereADaemonTakesOver) {
  Daemon daemon(kOverrideModel);
  Node node("test");
  auto low = node.output_port<int>("/low");
  auto in = node.input_port<int>("/p");
  Recording recording(daemon);
  low.publish(1);
  daemon.kill();
  low.publish(2);
  daemon.restart();
  low.publish(3);
  recording.wait_for<evidence::ModelChange>(
      [](const auto& model) { return model.generation == 2; });
  low.publish(4);
  EXPECT_EQ(recording.end(), 0) << recording.error();
  EXPECT_THAT(recording.error(),
              HasSubstr("arbiter: the daemon has gone; its last decisions stay in force, and "
                        "recording goes on\narbiter: a daemon is there again\n"));
  EXPECT_EQ(recording.records<Arrival>().size(), 4u);
  const json result = recording.simulate();
  EXPECT_EQ(result["equal"], 4) << result;
}

// Its page tells what its tap may not.
TEST(Record, KnowsWhoWinsWhereASourceMayNotBeTapped) {
  const TemporaryDirectory files;
  const std::string policy = files.write("policy", "deny everyone tap /high\nallow everyone all\n");
  Daemon daemon(kLasting, {.arguments = {"--policy", policy}});
  Node node("test");
  auto low = node.output_port<int>("/low");
  auto high = node.output_port<int>("/high");
  auto in = node.input_port<int>("/p");
  Recording recording(daemon, {"--compression", "none"});
  recording.see("cannot record /high");
  low.publish(1);
  high.publish(2);
  const auto wins = [](const char* source) {
    return [source](const WinnerChange& each) { return each.winner == source; };
  };
  recording.wait_for<WinnerChange>(wins("/high"));
  low.publish(3);
  high.deactivate();
  recording.wait_for<WinnerChange>(
      [](const WinnerChange& each) { return each.winner == "/low" && each.before == "/high"; });
  EXPECT_EQ(recording.end(), 0) << recording.error();
  const json result = recording.simulate();
  EXPECT_EQ(result["different"], 0) << result.dump(2);
  EXPECT_GE(result["behind_gap"], 1) << result.dump(2);
}

// One line of the policy, one sentence.
TEST(Record, SaysOnceWhatKeepsSeveralSourcesOut) {
  const TemporaryDirectory files;
  const std::string policy =
      files.write("policy", "deny everyone tap /low /high\nallow everyone all\n");
  Daemon daemon(R"(<behaviors><arbiter at="/p"><select from="/low"/></arbiter>
    <arbiter at="/q"><select from="/high"/></arbiter>
    <arbiter at="/r"><select from="/other"/></arbiter></behaviors>)",
                {.arguments = {"--policy", policy}});
  Recording recording(daemon);
  recording.see("recording 1 source");
  EXPECT_EQ(recording.end(), 0) << recording.error();
  const std::string said = recording.error();
  EXPECT_NE(said.find("cannot record /high and /low: user "), std::string::npos) << said;
  const auto first = said.find("may not tap");
  EXPECT_NE(first, std::string::npos) << said;
  EXPECT_EQ(said.find("may not tap", first + 1), std::string::npos) << said;
}

TEST(Record, TakesUpASourceOnceItCanBeTapped) {
  Daemon daemon(kLasting);
  Node node("test");
  auto low = node.output_port<int>("/low");
  auto high = node.output_port<int>("/high");
  auto in = node.input_port<int>("/p");
  std::vector<Tap<>> taps;
  TapOptions options;
  options.max_held = 0;
  for (int i = 0; i < 16; ++i) taps.push_back(node.tap("/high", options));
  Recording recording(daemon);
  recording.see("cannot record /high");
  high.publish(1);
  taps.clear();
  recording.see("recording /high from here on");
  await([&] { return daemon.taps_of("/high") == 1; });  // its publisher has answered
  high.publish(2);
  low.publish(3);
  EXPECT_EQ(recording.end(), 0) << recording.error();
  const auto arrivals = recording.records<Arrival>();
  ASSERT_EQ(arrivals.size(), 2u);
  EXPECT_EQ(arrivals[0].sequence, 2u);
  const json result = recording.simulate();
  EXPECT_EQ(result["equal"], 2) << result.dump(2);
}

TEST(Record, SaysWhatIsWrong) {
  Daemon daemon(kOverrideModel);
  const std::string file = daemon.directory() + "/there.mcap";
  std::ofstream(file) << "x";
  auto result = arbiter({"record", "-o", file});
  EXPECT_EQ(result.exit_code, 2);
  EXPECT_THAT(result.err, HasSubstr(file));
  EXPECT_EQ(content_of(file), "x");
  const std::string other = daemon.directory() + "/other.mcap";
  result = arbiter({"record", "-o", other, "--instance", "no-such"});
  EXPECT_EQ(result.exit_code, 1);
  EXPECT_FALSE(std::filesystem::exists(other));
  result = arbiter({"record", "-o", "-"});
  EXPECT_EQ(result.exit_code, 2);
  EXPECT_THAT(result.err, HasSubstr("cannot go to standard output"));
}

}  // namespace
}  // namespace arbiter::test
