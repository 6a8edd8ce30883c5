// What `arbiter record` writes of itself, and what `arbiter simulate --recording` says of
// recordings that show little.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <chrono>
#include <string>
#include <variant>

#include <arbiter/arbiter.hpp>

#include "evidence/record_writer.hpp"
#include "tests/evidence/incident.hpp"
#include "tests/recorder/recording.hpp"

namespace arbiter::test {
namespace {

using testing::AllOf;
using testing::HasSubstr;
using testing::Not;

ProgramResult simulated(const std::string& file) {
  return arbiter({"simulate", "--recording", file});
}

TEST(RecordedIncident, HasNothingToCompareWhereNoInputPortWasOpen) {
  Daemon daemon(kLasting);
  Node node("test");
  auto low = node.output_port<int>("/low");
  Recording recording(daemon);
  low.publish(1);
  recording.wait_for<evidence::Arrival>([](const auto&) { return true; });
  EXPECT_EQ(recording.end(), 0);
  const auto result = simulated(recording.file());
  EXPECT_EQ(result.exit_code, 1);
  EXPECT_THAT(result.out, HasSubstr("\nnothing to compare: no input port was open while it was "
                                    "recorded\n"));
  const auto other = arbiter(
      {"simulate", "--recording", recording.file(), "--model", daemon.directory() + "/model.xml"});
  EXPECT_EQ(other.exit_code, 1);
  EXPECT_THAT(other.out, HasSubstr("\nnothing to compare: no input port was open"));
}

TEST(RecordedIncident, HasNothingToCompareWhereNothingArrived) {
  Daemon daemon(kLasting);
  const std::string file = daemon.directory() + "/idle.mcap";
  ASSERT_EQ(arbiter({"record", "-o", file, "--duration", "20ms"}).exit_code, 0);
  const auto result = simulated(file);
  EXPECT_EQ(result.exit_code, 1);
  EXPECT_THAT(result.out, HasSubstr("nothing to compare: nothing arrived while it was recorded\n"));
}

TEST(RecordedIncident, HasNoNumbersWherePublishersBeganToCountAnew) {
  Incident incident;
  incident.arrive("/high", 1100, 1101, Incident::Fate::accepted);
  for (int i = 0; i < 3; ++i) incident.arrive("/low", 1200 + i, 1203, Incident::Fate::discarded);
  const TemporaryDirectory directory;
  const std::string file = directory.path() + "/restarts.mcap";
  evidence::RecordWriter writer(file, {}, {"program", "test", "host", "command", 5'000'000});
  for (evidence::Record record : incident.records()) {
    auto* const arrival = std::get_if<evidence::Arrival>(&record);
    if (arrival != nullptr && arrival->context->source == "/low") arrival->sequence = 1;
    writer.write(record);
  }
  writer.close(0);
  const auto other = directory.write("other.xml", kReversed);
  const auto result = arbiter({"simulate", "--recording", file, "--model", other}).out;
  EXPECT_THAT(result, HasSubstr("  /low, 3 arrivals at /p: delivered instead of discarded\n"));
}

TEST(ReplayOfNothing, SaysWhatTheRecordingHas) {
  Daemon daemon(kLasting);
  const std::string idle = daemon.directory() + "/idle.mcap";
  ASSERT_EQ(arbiter({"record", "-o", idle, "--duration", "20ms"}).exit_code, 0);
  auto result = arbiter({"replay", idle});
  EXPECT_EQ(result.exit_code, 1);
  EXPECT_EQ(result.err, "arbiter: " + idle + ": nothing arrived while it was recorded\n");

  Node node("test");
  auto low = node.output_port<int>("/low");
  auto high = node.output_port<int>("/high");
  Recording recording(daemon);
  low.publish(1);
  high.publish(1);
  EXPECT_EQ(recording.end(), 0);
  result = arbiter({"replay", recording.file(), "--source", "/X*", "--source", "/y"});
  EXPECT_EQ(result.exit_code, 2);
  EXPECT_THAT(result.err, HasSubstr("--source '/X*', /y matches no source in " + recording.file() +
                                    "; it has /high and /low\n"));
  result = arbiter({"replay", recording.file(), "--source", "/low", "--port", "/no-such"});
  EXPECT_EQ(result.exit_code, 1);
  EXPECT_THAT(result.err, HasSubstr("has no arrival of what you have chosen; it has /high and "
                                    "/low\n"));
}

TEST(ReplayThatIsInterrupted, SaysThatItWasStopped) {
  Daemon daemon(kLasting);
  std::string file;
  {
    Node node("test");
    auto low = node.output_port<int>("/low");
    Recording recording(daemon, {"--payloads", "all"});
    const Time before = std::chrono::steady_clock::now() - std::chrono::milliseconds(200);
    low.publish_at(before, 1);  // of what lies between, the replay makes ten seconds
    low.publish(2);
    EXPECT_EQ(recording.end(), 0);
    file = recording.file();
  }
  Node node("watcher");
  auto tap = node.tap("/low");
  const std::string path = daemon.directory() + "/replay.out";
  const shm::FileDescriptor out(::open(path.c_str(), O_WRONLY | O_CREAT | O_TRUNC, 0600));
  ChildProcess replay({ARBITER_PROGRAMS "/arbiter", "replay", file, "--speed", "0.02"}, {},
                      {-1, out.get(), -1});
  bool has_begun = false;
  while (!has_begun) {
    const auto event = tap.wait_for(std::chrono::hours(1));
    has_begun = event && event->kind() == TapEventKind::sample;
  }
  replay.signal(SIGINT);
  EXPECT_EQ(replay.wait(), 128 + SIGINT);
  EXPECT_THAT(content_of(path), testing::StartsWith("stopped before the end: 1 sample, "));
}

// One decision becomes blind, and the instance's name an attempt on the terminal.
TEST(RecordedIncident, ClaimsNoMoreThanItShows) {
  Daemon daemon(kLasting);
  Node node("test");
  auto low = node.output_port<int>("/low");
  auto in = node.input_port<int>("/p");
  Recording recording(daemon);
  low.publish(1);
  recording.wait_for<evidence::Arrival>([](const auto&) { return true; });
  EXPECT_EQ(recording.end(), 0);
  EXPECT_THAT(simulated(recording.file()).out, HasSubstr("\nevery decision is reproduced\n"));
  const std::string forged = daemon.directory() + "/forged.mcap";
  evidence::RecordWriter writer(forged, {}, {"program", "te\x1b[31mst", "", "", 0});
  evidence::read_recording(recording.file(), evidence::Payloads::read,
                           [&](evidence::Record&& record) {
                             auto* arrival = std::get_if<evidence::Arrival>(&record);
                             if (arrival != nullptr) {
                               std::swap(arrival->masks.accepted, arrival->masks.blind);
                             }
                             writer.write(record);
                           });
  writer.close();
  const auto result = simulated(forged);
  EXPECT_EQ(result.exit_code, 0);
  EXPECT_THAT(result.out, AllOf(HasSubstr("0 equal, 0 overlapped, 1 blind"),
                                HasSubstr("\nno decision is contradicted\n"),
                                HasSubstr(R"("te\x1b[31mst")"), Not(HasSubstr("\x1b"))));
}

TEST(RecordedIncident, SaysWhatWasTyped) {
  Daemon daemon(kLasting);
  const std::string file = daemon.directory() + "/short.mcap";
  const auto result =
      arbiter({"record", "-o", file, "--duration", "20ms", "--port", "/p*", "--port", "/don't*"});
  EXPECT_EQ(result.exit_code, 0) << result.err;
  EXPECT_THAT(result.err, AllOf(HasSubstr(R"(warning: --port '/don'\''t*' matches no input port)"),
                                Not(HasSubstr("--port '/p*' matches"))));
  EXPECT_THAT(arbiter({"record", "-o", file + "2", "--duration", "20ms", "--port", "/pp",
                       "--payloads", "/hihg*"})
                  .err,
              AllOf(HasSubstr("--port /pp matches no input port that is open or in the model in "
                              "force; did you mean \"/p\"?"),
                    HasSubstr("--payloads '/hihg*' matches no output port")));
  const auto info =
      nlohmann::json::parse(arbiter({"recording", "info", "--json", file}).out)["metadata"];
  ASSERT_EQ(info.size(), 2U) << info;
  EXPECT_EQ(info[1]["name"], "arbiter.end");
  EXPECT_EQ(info[0]["values"]["command"],
            std::string(ARBITER_PROGRAMS) + "/arbiter record -o " + file +
                R"( --duration 20ms --port '/p*' --port '/don'\''t*')");
}

// However long it takes until it can begin.
TEST(RecordedIncident, LastsAsLongAsItIsToldTo) {
  Daemon daemon(kLasting);
  const std::string file = daemon.directory() + "/long.mcap";
  const auto result = arbiter({"record", "-o", file, "--duration", "200ms"});
  ASSERT_EQ(result.exit_code, 0) << result.err;
  const std::size_t at = result.out.find(" in ");
  ASSERT_NE(at, std::string::npos) << result.out;
  EXPECT_GE(std::stod(result.out.substr(at + 4)), 0.2) << result.out;
}

}  // namespace
}  // namespace arbiter::test
