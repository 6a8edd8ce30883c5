// `arbiter replay`: what arrived once arrives again.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <array>
#include <chrono>
#include <filesystem>
#include <map>
#include <optional>

#include <arbiter/arbiter.hpp>

#include "evidence/recorded.hpp"
#include "tests/client/samples.hpp"
#include "tests/evidence/incident.hpp"
#include "tests/recorder/recording.hpp"

namespace arbiter::test {
namespace {

using testing::HasSubstr;

class Replay : public testing::Test {
 protected:
  // /low 1, /high 2, /low 3 (loses), /high gives up, /low 4; /text "abc".
  // Of the recorder, at the port that is open now.
  void await_tap() {
    await([&] { return daemon_.taps_of("/low") == 1; });
  }
  std::string record(const std::vector<std::string>& more = {"--payloads", "all"}) {
    Node node("test");
    auto in = node.input_port<Number>("/p", {.depth = 16});
    auto low = node.output_port<Number>("/low");
    auto high = node.output_port<Number>("/high");
    auto text = node.output_port("/text");
    Recording recording(daemon_, more);
    low.publish(Number{1});
    high.publish(Number{2});
    low.publish(Number{3});
    high.deactivate();
    low.publish(Number{4});
    const char abc[] = {'a', 'b', 'c'};
    text.publish(Bytes(reinterpret_cast<const std::byte*>(abc), sizeof abc));
    high.signal();
    high.deactivate();
    EXPECT_EQ(recording.end(), 0) << recording.error();
    const std::string kept = daemon_.directory() + "/kept.mcap";
    std::filesystem::rename(recording.file(), kept);
    return kept;
  }

  Daemon daemon_{kLasting};
};

// What was announced elsewhere is not true of this instance, and need not be known.
TEST_F(Replay, LeavesOutWhatIsAnnouncedThere) {
  const std::string announced = "/arbiter/winner/p:o";
  const std::string file = daemon_.directory() + "/announced.mcap";
  Node node("test");
  std::optional low = node.output_port<Number>("/low");
  std::optional winner = node.output_port<Number>(announced);
  for (const char* payloads : {"all", "/low"}) {
    if (!low) low.emplace(node.output_port<Number>("/low"));
    Recording recording(daemon_, {"--payloads", payloads});
    winner->publish(Number{1});
    low->publish(Number{1});
    EXPECT_EQ(recording.end(), 0) << recording.error();
    std::filesystem::rename(recording.file(), file);
    low.reset();
    const auto result = arbiter({"replay", file});
    EXPECT_EQ(result.exit_code, 0) << result.err;
    EXPECT_THAT(result.out, HasSubstr("1 sample, 0 signals and 0 deactivations of 1 source in"));
    EXPECT_THAT(result.err, HasSubstr("announces who commands: " + announced));
  }
  winner.reset();
  EXPECT_THAT(arbiter({"replay", file}).err,
              HasSubstr("what was in the samples of " + announced +
                        ", so they cannot be published: choose other sources with --source, or "
                        "record with --payloads all; announcements of who commands are left out "
                        "if `arbiter winners` runs in the instance"));
}

TEST_F(Replay, PublishesSamplesSignalsAndDeactivationsAgain) {
  const std::string file = record();
  EXPECT_EQ(arbiter({"deactivate", "/low"}).exit_code, 0);
  Node node("test");
  auto in = node.input_port<Number>("/p", {.depth = 16, .keep = true});
  auto text = node.input_port("/text-in");
  auto tap = node.tap("/text");
  const auto result = arbiter({"replay", file});
  EXPECT_EQ(result.exit_code, 0) << result.err;
  EXPECT_THAT(result.out, HasSubstr("5 samples, 1 signal and 2 deactivations of 3 sources in "));
  EXPECT_THAT(result.out, testing::Not(HasSubstr("none was delivered")));
  EXPECT_EQ(take_all(in), (std::vector<std::int64_t>{1, 2, 4}));
  std::optional<std::string> told;
  while (const auto event = tap.take()) {
    if (const auto bytes = event->sample()) {
      told.emplace(reinterpret_cast<const char*>(bytes->data()), bytes->size());
    }
  }
  EXPECT_EQ(told, "abc");
}

// Recorded again, the replay is decided as the original was.
TEST_F(Replay, IsDecidedAsTheOriginalWas) {
  const std::string file = record();
  const auto fates = [](const std::string& path) {
    std::vector<std::string> all;
    const auto recorded = evidence::load_recording(path);
    for (const auto& decision : recorded.runs.at(0).decisions) {
      all.push_back(decision.context->source + ' ' + std::to_string(decision.masks.accepted) + ' ' +
                    std::to_string(decision.masks.discarded));
    }
    return all;
  };
  EXPECT_EQ(arbiter({"deactivate", "/low"}).exit_code, 0);
  Node node("test");
  auto in = node.input_port<Number>("/p", {.depth = 16});
  Recording again(daemon_);
  EXPECT_EQ(arbiter({"replay", file, "--speed", "10"}).exit_code, 0);
  EXPECT_EQ(again.end(), 0) << again.error();
  EXPECT_EQ(fates(again.file()), fates(file));
  EXPECT_EQ(again.simulate()["different"], 0);
}

// An operator's, which no publisher tells.
TEST_F(Replay, DeactivatesWhatTheRecorderSawDeactivated) {
  Node node("test");
  auto in = node.input_port<Number>("/p", {.depth = 16});
  std::string file;
  {
    auto low = node.output_port<Number>("/low");
    Recording recording(daemon_, {"--payloads", "all"});
    { node.output_port<Number>("/high").publish(Number{1}); }
    low.publish(Number{2});
    EXPECT_EQ(arbiter({"deactivate", "/high"}).exit_code, 0);
    recording.wait_for<evidence::SourceState>(
        [](const auto& state) { return shm::is_deactivation(state.word); });
    low.publish(Number{3});
    EXPECT_EQ(recording.end(), 0) << recording.error();
    file = daemon_.directory() + "/kept.mcap";
    std::filesystem::rename(recording.file(), file);
  }
  EXPECT_EQ(arbiter({"deactivate", "/low"}).exit_code, 0);
  take_all(in);
  const auto result = arbiter({"replay", file, "--speed", "10"});
  EXPECT_THAT(result.out, HasSubstr("3 samples, 0 signals and 1 deactivation of 2 sources in "));
  EXPECT_EQ(take_all(in), (std::vector<std::int64_t>{1, 3}));
}

// What was active at the start arrives first, and what follows does so later, however fast.
TEST_F(Replay, GoesAsFastAsItIsAsked) {
  Node node("test");
  auto low = node.output_port<Number>("/low");
  low.publish(Number{1});
  Recording recording(daemon_, {"--payloads", "all"});
  for (int i = 0; i < 20; ++i) low.publish(Number{i});
  EXPECT_EQ(recording.end(), 0) << recording.error();
  { const auto closed = std::move(low); }
  const auto result = arbiter({"replay", recording.file(), "--speed", "10000"});
  EXPECT_EQ(result.exit_code, 0) << result.err;
}

// By the times that arrivals bear: these do not depend on when we are let run.
TEST_F(Replay, KeepsTheDistancesOfArrivals) {
  const std::string file = record();
  const auto times = [](const std::string& path) {
    std::vector<shm::Nanoseconds> all;
    const auto recorded = evidence::load_recording(path);
    for (const auto& decision : recorded.runs.at(0).decisions) {
      all.push_back(decision.arrival().time);
    }
    for (std::size_t i = all.size(); i-- > 1;) all[i] -= all[0];
    return all;
  };
  Recording again(daemon_);
  EXPECT_EQ(arbiter({"replay", file, "--source", "/low", "--source", "/text"}).exit_code, 0);
  EXPECT_EQ(again.end(), 0) << again.error();
  auto original = times(file);
  auto replayed = times(again.file());
  ASSERT_EQ(replayed.size(), 4u);
  EXPECT_EQ(replayed[1], original[2]);
  EXPECT_EQ(replayed[2], original[3]);
}

TEST_F(Replay, ChoosesSourcesOfInputPorts) {
  const std::string file = record();
  auto result = arbiter({"replay", file, "--port", "/p", "--as-fast-as-possible"});
  EXPECT_THAT(result.out, HasSubstr("4 samples, 1 signal and 2 deactivations of 2 sources"));
  EXPECT_THAT(result.out, HasSubstr("none was delivered: no input port that they are connected"));
  result = arbiter({"replay", file, "--port", "/no-such"});
  EXPECT_EQ(result.exit_code, 1);
  EXPECT_THAT(result.err, HasSubstr("has no arrival of what you have chosen"));
}

TEST_F(Replay, RefusesWhatHasNoPayload) {
  const std::string file = record({"--payloads", "/high"});
  auto result = arbiter({"replay", file});
  EXPECT_EQ(result.exit_code, 1);
  EXPECT_THAT(result.err, HasSubstr("does not have what was in the samples of /low, /text"));
  result = arbiter({"replay", file, "--source", "/high", "--as-fast-as-possible"});
  EXPECT_EQ(result.exit_code, 0) << result.err;
}

// A port has one type at a time; a sample is never published as what it is not.
TEST_F(Replay, MakesSignalsOfSamplesOfAnotherType) {
  Node node("test");
  Recording recording(daemon_, {"--payloads", "all"});
  {
    auto low = node.output_port<Number>("/low");
    await_tap();
    low.publish(Number{1});
  }
  const Type other("test/Other", sizeof(Number), alignof(Number));
  {
    auto low = node.output_port("/low", other);
    await_tap();
    low.publish(Bytes(std::array<std::byte, sizeof(Number)>{}.data(), sizeof(Number)));
  }
  {
    auto low = node.output_port<Number>("/low");
    await_tap();
    low.signal();
  }
  EXPECT_EQ(recording.end(), 0) << recording.error();
  auto tap = node.tap("/low");
  const auto result = arbiter({"replay", recording.file(), "--as-fast-as-possible"});
  EXPECT_EQ(result.exit_code, 0) << result.err;
  EXPECT_THAT(result.out, HasSubstr("1 sample, 1 signal and 0 deactivations of 1 source in "));
  EXPECT_THAT(result.out,
              HasSubstr("\n1 sample of another type than the last of /low became signals\n"));
  EXPECT_THAT(result.out, testing::Not(HasSubstr("whose payload is not in the recording")));
  std::vector<Type> types;
  while (const auto event = tap.take()) {
    if (event->sample()) types.push_back(event->type());
  }
  EXPECT_EQ(types, std::vector<Type>{other});
}

TEST_F(Replay, PublishesSamplesOfAnySizeAgain) {
  Node node("test");
  Recording recording(daemon_, {"--payloads", "all"});
  {
    auto low = node.output_port("/low", Type::variable("test/Text", 16));
    await_tap();
    for (const std::size_t size : {3u, 16u}) {
      low.publish(Bytes(std::array<std::byte, 16>{}.data(), size));
    }
  }
  EXPECT_EQ(recording.end(), 0) << recording.error();
  const auto result = arbiter({"replay", recording.file()});
  EXPECT_EQ(result.exit_code, 0) << result.err;
  EXPECT_THAT(result.out, HasSubstr("2 samples, 0 signals and 0 deactivations of 1 source in "));
}

// Else those that it keeps out would drive.
TEST_F(Replay, BeginsWithASourceWhoseTIsNotInTheRecording) {
  Incident incident("no model", {"/low"});
  incident.state("/high", 900, 990, shm::arrival(900, 500));
  incident.deactivate("/low", 1010, 1011);
  Node node("test");
  auto tap = node.tap("/high");
  const auto result = arbiter({"replay", incident.file()});
  EXPECT_EQ(result.exit_code, 0) << result.err;
  EXPECT_THAT(result.err, HasSubstr("the recording does not have the T of /high from before its "
                                    "start: the replay begins with a signal there"));
  bool has_arrived = false;
  while (const auto event = tap.take()) has_arrived |= event->kind() == TapEventKind::signal;
  EXPECT_TRUE(has_arrived);
}

TEST_F(Replay, UnderstandsTheFormerNameOfItsSpeed) {
  const std::string file = record();
  EXPECT_EQ(arbiter({"replay", file, "--rate", "10"}).exit_code, 0);
  EXPECT_EQ(arbiter({"replay", file, "--rate", "10", "--speed", "10"}).exit_code, 2);
  EXPECT_THAT(arbiter({"replay", "--help"}).out, testing::Not(HasSubstr("--rate")));
}

// Of a file that anybody has made: its times may be anything.
TEST_F(Replay, RefusesWhatWouldNotEnd) {
  for (const auto& [time, speed] : std::map<shm::Nanoseconds, const char*>{
           {shm::kMaxTime / 100, "0.001"}, {shm::kMaxTime, "1"}}) {
    Incident incident;
    incident.deactivate("/low", time, time);
    const auto result = arbiter({"replay", incident.file(), "--speed", speed});
    EXPECT_EQ(result.exit_code, 1) << result.err;
    EXPECT_THAT(result.err, HasSubstr("would take more than 70 years at this speed"));
  }
}

TEST_F(Replay, PrintsNothingThatATerminalObeys) {
  const std::string file = record();
  const std::string red = file + "\x1b[31m";
  std::filesystem::copy(file, red);
  std::filesystem::resize_file(red, std::filesystem::file_size(red) - 20);
  const auto result = arbiter({"replay", red});
  EXPECT_THAT(result.err, HasSubstr(file + "\\x1b[31m: "));
  EXPECT_THAT(result.err, HasSubstr("; what comes before is published\n"));
  EXPECT_THAT(result.err, testing::Not(HasSubstr("\x1b[31m")));
}

TEST_F(Replay, NeedsItsPorts) {
  const std::string file = record();
  Node node("test");
  auto low = node.output_port<Number>("/low");
  const auto result = arbiter({"replay", file});
  EXPECT_EQ(result.exit_code, 1);
  EXPECT_THAT(result.err, HasSubstr("/low is held by node \"test\" (pid "));
  EXPECT_THAT(result.err, HasSubstr("). Stop that component, choose other sources with --source, "
                                    "or replay into an instance of its own with --instance\n"));
}

}  // namespace
}  // namespace arbiter::test
