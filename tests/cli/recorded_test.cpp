// What `arbiter record` writes of itself, and what `arbiter simulate --recording` says of
// recordings that show little.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <string>

#include <arbiter/arbiter.hpp>

#include "evidence/record_writer.hpp"
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

}  // namespace
}  // namespace arbiter::test
