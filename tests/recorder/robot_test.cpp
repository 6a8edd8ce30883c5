// A robot of twenty components, watched in every way at once: it is tapped, recorded, one of its
// components is killed, and what was recorded is decided again and replayed.
#include <gtest/gtest.h>

#include <filesystem>
#include <string>
#include <vector>

#include "evidence/records.hpp"
#include "tests/recorder/recording.hpp"
#include "tests/support/await.hpp"

namespace arbiter::test {
namespace {

constexpr int kMotors = 6;
const std::string kProgram = ARBITER_PROGRAMS "/arbiter";

std::string numbered(const std::string& name, int number) {
  return "/" + name + std::to_string(number) + ":o";
}

// Each motor is driven by a navigation unless its teleoperation speaks, which is slower than its T:
// so command changes several times a second. A stop ends all teleoperation.
std::string model() {
  std::string text = "<behaviors timeout='150ms'><source port='/watchdog:o' timeout='2s'/>";
  for (int i = 0; i < kMotors; ++i) {
    const std::string number = std::to_string(i);
    const std::string at = "<config at='/motor" + number + ":i'>";
    text += "<behavior name='N" + number + "'>" + at + numbered("nav", i) + "</config></behavior>";
    text += "<behavior name='T" + number + "'>" + at + numbered("tele", i) +
            "</config><condition>not /stop:o and /watchdog:o</condition><inhibition>N" + number +
            "</inhibition></behavior>";
  }
  return text + "</behaviors>";
}

TEST(Robot, OfTwentyComponentsIsTappedRecordedKilledDumpedReplayedAndSimulated) {
  Daemon daemon(model());
  const TemporaryDirectory files;
  const std::string flight = files.path() + "/flight";
  std::vector<ChildProcess> motors;
  for (int i = 0; i < kMotors; ++i) {
    const std::vector<std::string> motor{kProgram, "echo", "/motor" + std::to_string(i) + ":i",
                                         "--as-component"};
    motors.emplace_back(motor, Environment{}, ChildProcess::Streams{});
  }
  for (int i = 0; i < kMotors; ++i) {
    await([&] { return daemon.input("/motor" + std::to_string(i) + ":i")["open"] == true; });
  }
  Recording recording(daemon, {"--payloads", "all"});
  ChildProcess ring({kProgram, "record", "--ring", "60s", "-o", flight}, {}, {});
  const ChildProcess tap({kProgram, "echo", "/motor0:i", "--losers"}, {}, {});
  std::vector<ChildProcess> publishers;
  const auto publish = [&](const std::string& source, const char* rate) {
    publishers.emplace_back(
        std::vector<std::string>{kProgram, "pub", source, "--rate", rate, "--quiet"}, Environment{},
        ChildProcess::Streams{});
  };
  for (int i = 0; i < kMotors; ++i) {
    publish(numbered("nav", i), "50");
    publish(numbered("tele", i), "3");
  }
  publish("/watchdog:o", "5");
  publish("/stop:o", "2");
  ASSERT_EQ(motors.size() + publishers.size(), 20u);
  await([&] { return std::filesystem::exists(flight + ".sock"); });
  // Each motor has been commanded by both.
  for (int i = 0; i < kMotors; ++i) {
    for (const char* name : {"nav", "tele"}) {
      recording.wait_for<evidence::WinnerChange>(
          [&](const auto& each) { return each.winner == numbered(name, i); });
    }
  }
  publishers[0].kill();
  recording.wait_for<evidence::PortChange>(
      [](const auto& each) { return each.what == evidence::PortChange::What::died; });
  const auto dumped = arbiter({"record", "--dump", "-o", flight});
  EXPECT_EQ(dumped.exit_code, 0) << dumped.err;
  for (std::size_t i = 1; i < publishers.size(); ++i) {
    publishers[i].signal(SIGINT);
    EXPECT_EQ(publishers[i].wait(), 0);
  }
  // No component has noticed: nothing was lost on the way to a motor.
  for (int i = 0; i < kMotors; ++i) {
    const auto input = daemon.input("/motor" + std::to_string(i) + ":i");
    EXPECT_GT(input["taken"], 0) << input;
    for (const char* counter : {"overtaken", "misbehaved", "unsettled"}) {
      EXPECT_EQ(input[counter], 0) << counter << ": " << input;
    }
  }
  EXPECT_EQ(recording.end(), 0) << recording.error();
  await([&] { return files_in(files.path()).size() >= 2; });
  ring.signal(SIGINT);
  EXPECT_EQ(ring.wait(), 0);
  std::vector<std::string> recordings = files_in(files.path());
  EXPECT_EQ(recordings.size(), 2u) << "of the death, and the one that was asked for";
  recordings.push_back(recording.file());
  for (const std::string& file : recordings) {
    const auto simulated = arbiter({"simulate", "--recording", file});
    EXPECT_EQ(simulated.exit_code, 0) << simulated.out << simulated.err;
    // Before the recorder has joined a source it does not know it, so decisions of just then may
    // depend on what it could not see. Of what came afterwards it has all.
    const auto info = arbiter({"recording", "info", "--json", file});
    EXPECT_EQ(info.exit_code, 0) << info.err;
    const auto said = nlohmann::json::parse(info.out);
    EXPECT_EQ(said["missed_events"], 0) << info.out << simulated.out;
    EXPECT_EQ(said["missed_samples"], 0) << info.out << simulated.out;
  }
  const auto replayed = arbiter({"replay", recording.file(), "--speed", "4"});
  EXPECT_EQ(replayed.exit_code, 0) << replayed.err;
}

}  // namespace
}  // namespace arbiter::test
