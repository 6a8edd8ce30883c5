// What `arbiter recording` says of files, and makes of them.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <span>
#include <sstream>
#include <string>

#include <nlohmann/json.hpp>

#include "recording/mcap.hpp"
#include "tests/cli/arbiter_program.hpp"
#include "tests/support/documented_fields.hpp"
#include "tests/support/temporary_directory.hpp"
#include "tests/support/text_files.hpp"

namespace arbiter::test {
namespace {

using nlohmann::json;
using testing::AllOf;
using testing::ContainsRegex;
using testing::HasSubstr;
using testing::IsEmpty;
using testing::Not;

constexpr recording::McapTime kSecond = 1'000'000'000;
constexpr recording::McapTime kNoon = 1'700'000'000 * kSecond;

// A message each 100 ms, 21 in all; then one with a name that would mislead, which is the last.
void write_recording(const std::string& path, recording::McapTime begin = kNoon) {
  recording::McapWriter writer(path, "arbiter test", {recording::Compression::lz4});
  const auto schema = writer.add_schema({"arbiter.Arrival", "jsonschema", "{}"});
  const auto often = writer.add_channel({schema, "/Arm/pos:i", "json", {{"node", "Arm"}}});
  const auto once = writer.add_channel({0, "/evil\x1b[31m:o", "raw", {}});
  writer.add_channel({schema, "/Never:o", "json", {}});
  const std::string data(50, 'x');
  const std::span bytes(reinterpret_cast<const std::byte*>(data.data()), data.size());
  for (std::uint32_t i = 0; i <= 20; ++i) {
    const auto time = begin + i * kSecond / 10;
    writer.write({often, i, time, time, bytes});
  }
  writer.write_metadata("arbiter", {{"host", "robot"}, {"long", std::string(200, 'l')}});
  writer.write_attachment({"model.xml", "application/xml", begin, "<behaviors/>"});
  writer.write({once, 0, begin + 90 * kSecond, 0, bytes});
  writer.close();
}

class RecordingVerb : public testing::Test {
 protected:
  RecordingVerb() { write_recording(whole_); }

  // What is left if the writer is killed before it closes the second chunk.
  std::string cut() {
    const std::string content = content_of(whole_);
    return directory_.write("cut.mcap", content.substr(0, content.size() / 2));
  }

  TemporaryDirectory directory_;
  std::string whole_ = directory_.file("whole.mcap");
};

TEST_F(RecordingVerb, ShowsWhatAFileHas) {
  const auto result = arbiter({"recording", "info", whole_});
  EXPECT_EQ(result.exit_code, 0) << result.err;
  EXPECT_THAT(result.out, ContainsRegex("state +whole\n"));
  EXPECT_THAT(result.out, ContainsRegex("written by +arbiter test\n"));
  EXPECT_THAT(result.out, ContainsRegex("begin +2023-11-1[45] ..:.3:20\\.000 [+-][0-9]{4}\n"));
  EXPECT_THAT(result.out, ContainsRegex("length +90\\.000 s \\(0:01:30\\)\n"));
  EXPECT_THAT(result.out, ContainsRegex("messages +22\n"));
  EXPECT_THAT(result.out, ContainsRegex("chunks +2 of lz4, "));
  EXPECT_THAT(result.out, ContainsRegex("21 +10\\.0  arbiter\\.Arrival  /Arm/pos:i\n"));
  EXPECT_THAT(result.out, ContainsRegex("1 +-  - +/evil\\\\x1b\\[31m:o\n"));
  EXPECT_THAT(result.out, ContainsRegex("0 +-  arbiter\\.Arrival  /Never:o\n"));
  EXPECT_THAT(result.out, HasSubstr("metadata arbiter\n  host = robot\n"));
  EXPECT_THAT(result.out, ContainsRegex("12 bytes  application/xml +model\\.xml\n"));
  EXPECT_THAT(result.out, Not(HasSubstr("\x1b")));
  EXPECT_THAT(result.err, IsEmpty());
}

TEST_F(RecordingVerb, CountsOneByteAsOne) {
  const std::string path = directory_.file("byte.mcap");
  recording::McapWriter writer(path, "arbiter test", {});
  writer.write_attachment({"note", "text/plain", kNoon, "x"});
  writer.close();
  EXPECT_THAT(arbiter({"recording", "info", path}).out,
              ContainsRegex(" 1 byte  text/plain +note\n"));
}

// A type is what one looks for, and records are no samples.
TEST_F(RecordingVerb, CutsNoNameAndTellsTheFrequencyOfSamplesOnly) {
  const std::string path = directory_.file("types.mcap");
  const std::string type = "geometry_msgs/msg/TwistWithCovarianceStamped";
  const std::string topic = "/Base/a/name/that/takes/the/rest/of/the/line:o";
  {
    recording::McapWriter writer(path, "arbiter test", {});
    const auto record = writer.add_channel(
        {writer.add_schema({"arbiter.Winner", "jsonschema", "{}"}), "arbiter/winner", "json", {}});
    const auto samples =
        writer.add_channel({writer.add_schema({type, "", ""}), topic, "x-arbiter-bytes", {}});
    for (std::uint32_t i = 0; i <= 20; ++i) {
      const auto time = kNoon + i * kSecond / 10;
      for (const auto channel : {record, samples}) writer.write({channel, i, time, time, {}});
    }
    writer.close();
  }
  const auto result = arbiter({"recording", "info", path});
  EXPECT_THAT(result.out, ContainsRegex("21 +10\\.0  " + type + "\n +" + topic + "\n"));
  EXPECT_THAT(result.out, ContainsRegex("21 +-  arbiter\\.Winner  arbiter/winner\n"));
  const json channels = json::parse(arbiter({"recording", "info", "--json", path}).out)["channels"];
  EXPECT_TRUE(channels[0]["rate"].is_null());
  EXPECT_NEAR(channels[1]["rate"].get<double>(), 10, 1e-6);
}

TEST_F(RecordingVerb, KeepsTo80Columns) {
  const std::string path = cut();
  for (const auto& file : {whole_, path}) {
    std::istringstream lines(arbiter({"recording", "info", file}).out);
    for (std::string line; std::getline(lines, line);) {
      if (line.find(file) != std::string::npos) continue;
      EXPECT_LE(line.size(), 80U) << line;
    }
  }
}

// A machine's monotonic clock has no date.
TEST_F(RecordingVerb, MakesNoDateOfAClockThatHasNone) {
  const std::string path = directory_.file("boot.mcap");
  write_recording(path, 77 * kSecond);
  EXPECT_THAT(arbiter({"recording", "info", path}).out,
              ContainsRegex("begin +77\\.000 s of its clock\n"));
}

TEST_F(RecordingVerb, SaysWhyAFileIsNotWhole) {
  const std::string path = cut();
  const auto result = arbiter({"recording", "info", path});
  EXPECT_EQ(result.exit_code, 1);
  EXPECT_THAT(result.out,
              AllOf(ContainsRegex("state +not whole; what follows is in the first"),
                    ContainsRegex("problem +at byte [0-9]+, the "), ContainsRegex("messages +21\n"),
                    HasSubstr("arbiter recording repair " + path)));
}

TEST_F(RecordingVerb, AdvisesNoRepairWhereNothingIsWhole) {
  const std::string empty = directory_.write("empty.mcap", "");
  auto result = arbiter({"recording", "info", empty});
  EXPECT_EQ(result.exit_code, 1);
  EXPECT_THAT(result.out, AllOf(ContainsRegex("state +the file is empty\n"),
                                Not(HasSubstr("arbiter recording repair"))));
  EXPECT_THAT(arbiter({"recording", "repair", empty}).err, HasSubstr("the file is empty"));
  result =
      arbiter({"recording", "info", directory_.write("b.mcap", content_of(whole_).substr(0, 8))});
  EXPECT_EQ(result.exit_code, 1);
  EXPECT_THAT(result.out, Not(HasSubstr("arbiter recording repair")));
}

TEST_F(RecordingVerb, RepairsBesideTheFile) {
  const std::string path = cut();
  const std::string before = content_of(path);
  const auto result = arbiter({"recording", "repair", path});
  EXPECT_EQ(result.exit_code, 0) << result.err;
  const std::string made = directory_.file("cut.repaired.mcap");
  EXPECT_THAT(result.out, AllOf(HasSubstr("wrote " + made + ": 21 messages, from the first"),
                                HasSubstr("behind them, at byte ")));
  EXPECT_EQ(content_of(path), before);
  const auto info = arbiter({"recording", "info", made});
  EXPECT_EQ(info.exit_code, 0);
  EXPECT_THAT(info.out, AllOf(ContainsRegex("messages +21\n"), HasSubstr("metadata repaired\n"),
                              ContainsRegex("by = arbiter [0-9.]+\n")));
  EXPECT_EQ(arbiter({"recording", "repair", path}).exit_code, 2) << "the new file is there now";
  EXPECT_EQ(arbiter({"recording", "repair", path, "-o", directory_.file("b.mcap")}).exit_code, 0);
}

TEST_F(RecordingVerb, LeavesAWholeFileAsItIs) {
  const auto result = arbiter({"recording", "repair", whole_, "-o", directory_.file("new.mcap")});
  EXPECT_EQ(result.exit_code, 0);
  EXPECT_EQ(result.out, whole_ + " is whole; nothing was written\n");
  EXPECT_FALSE(std::filesystem::exists(directory_.file("new.mcap")));
}

TEST_F(RecordingVerb, ExitsWith2WhereThereIsNothingToRead) {
  const std::string text = directory_.write("a.txt", "no recording\n");
  const std::string beginning = directory_.write("b.mcap", content_of(whole_).substr(0, 8));
  for (const std::vector<std::string>& arguments :
       std::vector<std::vector<std::string>>{{"recording"},
                                             {"recording", "info"},
                                             {"recording", "info", text},
                                             {"recording", "info", directory_.file("missing")},
                                             {"recording", "repair", text},
                                             {"recording", "repair", beginning}}) {
    const auto result = arbiter(arguments);
    EXPECT_EQ(result.exit_code, 2) << testing::PrintToString(arguments);
    EXPECT_THAT(result.err, Not(IsEmpty()));
    EXPECT_THAT(result.out, IsEmpty());
  }
}

TEST_F(RecordingVerb, AreNotWrittenToStandardOutput) {
  const std::string path = cut();
  for (const std::vector<std::string>& verb :
       {std::vector<std::string>{"recording", "repair", path}, {"record"}}) {
    for (const char* output : {"-", "/dev/stdout"}) {
      std::vector<std::string> arguments = verb;
      arguments.insert(arguments.end(), {"-o", output});
      const auto result = arbiter(arguments);
      EXPECT_EQ(result.exit_code, 2);
      EXPECT_THAT(result.err, HasSubstr("a recording is a file, and cannot go to standard output"));
    }
  }
}

TEST_F(RecordingVerb, NamesFilesSoThatTheyCanBePastedAndObeysNothingInThem) {
  const std::string path = directory_.file("my  \x1b[31m cut.mcap");
  std::filesystem::rename(cut(), path);
  const std::string shown = directory_.file("my  \\x1b[31m cut");
  const auto info = arbiter({"recording", "info", path}).out;
  EXPECT_THAT(info, HasSubstr("file          " + shown + ".mcap\n"));
  EXPECT_THAT(info, HasSubstr("\n  arbiter recording repair '" + shown + ".mcap'\n"));
  const auto repaired = arbiter({"recording", "repair", path});
  EXPECT_THAT(repaired.out, HasSubstr("wrote " + shown + ".repaired.mcap: "));
  const std::string whole = directory_.file("my  \x1b[31m cut.repaired.mcap");
  EXPECT_THAT(arbiter({"recording", "repair", whole}).out,
              HasSubstr(shown + ".repaired.mcap is whole"));
  EXPECT_THAT(arbiter({"recording", "export", path, "--csv", "-"}).err, Not(HasSubstr("\x1b")));
}

TEST_F(RecordingVerb, LeavesNothingOfARepairForWhichThereIsNoRoom) {
  const std::string to = directory_.file("new.mcap");
  const std::string path = cut();
  const auto result = run_program(
      {"/bin/bash", "-c",
       "ulimit -f 0; exec " ARBITER_PROGRAMS "/arbiter recording repair " + path + " -o " + to});
  EXPECT_EQ(result.exit_code, 2);
  EXPECT_THAT(result.err, AllOf(HasSubstr(to), HasSubstr("File too large"), HasSubstr("deleted")));
  EXPECT_FALSE(std::filesystem::exists(to));
}

TEST_F(RecordingVerb, ExportsNeitherOverTheRecordingNorTwiceIntoOneFile) {
  const std::string before = content_of(whole_);
  const std::string link = directory_.file("link.csv");
  std::filesystem::create_symlink(whole_, link);
  for (const auto* option : {"--trace", "--csv"}) {
    for (const std::string& output : {whole_, link}) {
      const auto result = arbiter({"recording", "export", whole_, option, output});
      EXPECT_EQ(result.exit_code, 2);
      EXPECT_THAT(result.err, HasSubstr(option + (" " + output) + " would overwrite "));
    }
  }
  const std::string out = directory_.file("new.csv");
  const std::vector<std::pair<std::string, std::string>> same = {
      {out, directory_.file("./new.csv")},
      {"new.csv", "./new.csv"},
      {"./new.csv", "new.csv"},
      {"new.csv", out},
      {"-", "/dev/stdout"}};
  for (const auto& [trace, csv] : same) {
    const auto result =
        run_program({"/usr/bin/env", "-C", directory_.path(), ARBITER_PROGRAMS "/arbiter",
                     "recording", "export", whole_, "--trace", trace, "--csv", csv});
    EXPECT_EQ(result.exit_code, 2) << trace << " " << csv;
    EXPECT_THAT(result.err, HasSubstr("are one file; nothing was written"));
    EXPECT_FALSE(std::filesystem::exists(out));
  }
  EXPECT_EQ(run_program({"/usr/bin/env", "-C", directory_.path(), ARBITER_PROGRAMS "/arbiter",
                         "recording", "export", "whole.mcap", "--csv", "./whole.mcap", "--force"})
                .exit_code,
            2);
  EXPECT_EQ(content_of(whole_), before);
}

// Somebody may have changed it by hand, or have the recording no more.
TEST_F(RecordingVerb, ExportsOverNoFileUnlessItIsToldTo) {
  const std::string there = directory_.write("there.csv", "mine");
  const std::string other = directory_.file("other.csv");
  for (const auto& [trace, csv] : {std::pair(there, other), std::pair(other, there)}) {
    const std::vector<std::string> verb{"recording", "export", whole_, "--trace",
                                        trace,       "--csv",  csv};
    const auto result = arbiter(verb);
    EXPECT_EQ(result.exit_code, 2);
    EXPECT_THAT(result.err, HasSubstr(there + " is there already; nothing was written: give "
                                              "another file, or --force to replace it"));
    EXPECT_EQ(content_of(there), "mine");
    EXPECT_FALSE(std::filesystem::exists(other));
  }
  // This is no recording of Arbiter's, which is found out behind that.
  for (const std::vector<std::string>& output :
       {std::vector<std::string>{there, "--force"}, {"-"}, {"/dev/null"}, {"/dev/stdout"}}) {
    std::vector<std::string> verb{"recording", "export", whole_, "--csv"};
    verb.insert(verb.end(), output.begin(), output.end());
    EXPECT_THAT(arbiter(verb).err, Not(HasSubstr("is there already"))) << output.front();
  }
}

// A recording of these alone.
std::string with_records(std::string path, const std::string& topic,
                         const std::vector<std::string>& records) {
  recording::McapWriter writer(path, "arbiter test", {});
  const auto channel = writer.add_channel({0, topic, "json", {}});
  for (const std::string& text : records) {
    writer.write({channel, 0, kNoon, kNoon, std::as_bytes(std::span(text))});
  }
  writer.close();
  return path;
}

// Ports as a recorder notes them, and some that it would not.
std::string with_imports(const TemporaryDirectory& directory) {
  return with_records(
      directory.file("imports.mcap"), "arbiter/port",
      {R"({"port": "/b:o", "host": "rear"})", R"({"port": "/b:o", "host": "head"})",
       R"({"port": "/b:o", "host": "head"})", R"({"port": "/a:o", "host": "he\u001bad"})",
       R"({"port": "/here:o"})", R"({"port": 5, "host": 6})", "[", "7"});
}

TEST_F(RecordingVerb, SaysFromWhichHostsSourcesCame) {
  const auto result = arbiter({"recording", "info", with_imports(directory_)});
  EXPECT_EQ(result.exit_code, 0) << result.err;
  EXPECT_THAT(result.out, HasSubstr("\nsources of other hosts\n  /a:o  from he\\x1bad\n"
                                    "  /b:o  from head, rear\n"));
  EXPECT_THAT(arbiter({"recording", "info", whole_}).out, Not(HasSubstr("other hosts")));
}

// As a recorder notes them, and some that it would not.
std::string with_unrecorded(const TemporaryDirectory& directory) {
  return with_records(
      directory.file("unrecorded.mcap"), "arbiter/missed",
      {R"({"source": "/b:o", "why": "refused", "text": "no\u001b"})",
       R"({"source": "/a:o", "why": "stranger", "text": "of component nav, pid 7"})",
       R"({"source": "/c:o", "why": "queue", "text": ""})", R"({"source": 5, "why": 6})", "["});
}

TEST_F(RecordingVerb, SaysWhichSourcesWereNotRecorded) {
  const auto result = arbiter({"recording", "info", with_unrecorded(directory_)});
  EXPECT_EQ(result.exit_code, 0) << result.err;
  EXPECT_THAT(result.out, HasSubstr("\nsources that were not recorded, at least for a while\n"
                                    "  /a:o: of component nav, pid 7\n  /b:o: no\\x1b\n"));
  EXPECT_THAT(result.out, Not(HasSubstr("/c:o")));
  EXPECT_THAT(arbiter({"recording", "info", whole_}).out, Not(HasSubstr("not recorded")));
}

// In both directions.
TEST_F(RecordingVerb, WritesTheDocumentThatThePageDescribes) {
  ObservedFields observed({"metadata[].values", "channels[].metadata"});
  for (const std::string& path :
       {whole_, cut(), with_imports(directory_), with_unrecorded(directory_)}) {
    observed.see(json::parse(arbiter({"recording", "info", "--json", path}).out));
  }
  const std::string empty = directory_.file("empty.mcap");
  recording::McapWriter(empty, "test", {}).close();
  observed.see(json::parse(arbiter({"recording", "info", "--json", empty}).out));
  const std::string page = content_of(std::string(ARBITER_TEST_DATA) + "/../../docs/recording.md");
  EXPECT_THAT(disagreements(page, observed), IsEmpty());
}

}  // namespace
}  // namespace arbiter::test
