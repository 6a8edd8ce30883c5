// `arbiter recording sample`.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <memory>
#include <optional>
#include <string>

#include "evidence/record_writer.hpp"
#include "tests/cli/arbiter_program.hpp"
#include "tests/recorder/in_zone.hpp"
#include "tests/support/temporary_directory.hpp"
#include "tests/support/text_files.hpp"

namespace arbiter::test {
namespace {

using testing::HasSubstr;

constexpr shm::Nanoseconds kSecond = 1'000'000'000;

// The wall clock shows what the recording's shows: it begins at 1970-01-01 00:00:00.
class RecordedSample : public testing::Test {
 protected:
  RecordedSample() {
    evidence::RecordWriter writer(file_, {}, {"arbiter", "test", "robot", "", 0});
    const auto add = [&](const char* source, const char* type, std::uint64_t sequence,
                         shm::Nanoseconds time, std::optional<std::string> bytes,
                         bool is_sample = true) {
      auto context = std::make_shared<evidence::SourceContext>();
      context->source = source;
      context->is_described = true;
      context->type = type;
      evidence::SourceState state;
      state.context = context;
      state.seen = time;
      state.why = evidence::SourceState::Why::joined;
      writer.write(state);
      evidence::Arrival arrival;
      arrival.context = std::move(context);
      arrival.time = arrival.seen = time;
      arrival.is_sample = is_sample;
      arrival.sequence = sequence;
      arrival.has_payload = bytes.has_value();
      if (bytes) {
        const auto* const begin = reinterpret_cast<const std::byte*>(bytes->data());
        arrival.payload.emplace(begin, begin + bytes->size());
      }
      writer.write(arrival);
    };
    writer.write(evidence::Start{kSecond, "test", {}, "all"});
    add("/Nav/cmd:o", "geometry_msgs/msg/Twist", 7, 1 * kSecond, std::string("a\0b", 3));
    add("/Joy/cmd:o", "", 1, 2 * kSecond, "not of Nav");
    add("/Nav/cmd:o", "geometry_msgs/msg/Twist", 8, 3 * kSecond, "second");
    add("/Nav/cmd:o", "geometry_msgs/msg/Twist", 8, 4 * kSecond, {}, false);  // a signal
    add("/Nav/cmd:o", "geometry_msgs/msg/Twist", 9, 5 * kSecond, {});
    add("/again", "", 1, 6 * kSecond, "first life");
    add("/again", "", 1, 7 * kSecond, "second life");
    add("/none", "", 1, 8 * kSecond, {});
    add("/signals", "", 0, 9 * kSecond, {}, false);
    writer.close();
  }

  ProgramResult sample(const std::string& source, const std::vector<std::string>& more = {}) {
    std::vector<std::string> arguments{"recording", "sample", file_, "--source", source};
    arguments.insert(arguments.end(), more.begin(), more.end());
    return arbiter_in_utc(arguments);
  }
  void expect_refusal(const ProgramResult& result, const std::string& why) {
    EXPECT_EQ(result.exit_code, 2);
    EXPECT_EQ(result.out, "");
    EXPECT_THAT(result.err, HasSubstr(why));
  }

  TemporaryDirectory directory_;
  std::string file_ = directory_.file("recording.mcap");
};

TEST_F(RecordedSample, IsWrittenAsItWasPublishedAndNamedOnStandardError) {
  const auto result = sample("/Nav/cmd:o", {"--sequence", "7"});
  EXPECT_EQ(result.exit_code, 0) << result.err;
  EXPECT_EQ(result.out, std::string("a\0b", 3));
  EXPECT_EQ(result.err,
            "sample 7 of /Nav/cmd:o, which came at 1970-01-01 00:00:01.000: 3 bytes, "
            "geometry_msgs/msg/Twist\n");
}

TEST_F(RecordedSample, IsTheLastThatWasRecordedIfNoneIsNamed) {
  EXPECT_EQ(sample("/Nav/cmd:o").out, "second");
  EXPECT_EQ(sample("/again").out, "second life");
}

TEST_F(RecordedSample, IsTheLastThatHadComeByATime) {
  EXPECT_EQ(sample("/Nav/cmd:o", {"--at", "00:00:02"}).out, std::string("a\0b", 3));
  EXPECT_EQ(sample("/Nav/cmd:o", {"--at", "00:00:04"}).out, "second");
  EXPECT_EQ(sample("/again", {"--at", "00:00:06.5"}).out, "first life");
}

// The last sample is the last, however long nothing comes behind it.
TEST_F(RecordedSample, IsTheLastWhileRecordingGoesOn) {
  file_ = directory_.file("quiet.mcap");
  {
    evidence::RecordWriter writer(file_, {}, {"arbiter", "test", "robot", "", 0});
    writer.write(evidence::Start{kSecond, "test", {}, "all"});
    evidence::Arrival arrival;
    auto context = std::make_shared<evidence::SourceContext>();
    context->source = "/quiet";
    arrival.context = std::move(context);
    arrival.time = arrival.seen = 2 * kSecond;
    arrival.is_sample = arrival.has_payload = true;
    arrival.payload.emplace(4, std::byte{'x'});
    writer.write(arrival);
    writer.close(60 * kSecond);
  }
  EXPECT_EQ(sample("/quiet", {"--at", "00:00:59"}).out, "xxxx");
  expect_refusal(sample("/quiet", {"--at", "00:00:01"}), "by then no sample of /quiet had come");
  expect_refusal(sample("/quiet", {"--at", "00:01:30"}), "is not in the recording");
}

TEST_F(RecordedSample, GoesToAFileButNotToTheRecording) {
  const std::string bytes = directory_.file("bytes");
  EXPECT_EQ(sample("/Joy/cmd:o", {"-o", bytes}).exit_code, 0);
  EXPECT_EQ(content_of(bytes), "not of Nav");
  expect_refusal(sample("/Joy/cmd:o", {"-o", file_}), "would overwrite the input");
}

TEST_F(RecordedSample, ReplacesNoFileUnlessItIsToldTo) {
  const std::string there = directory_.write("there", "mine");
  expect_refusal(sample("/Joy/cmd:o", {"-o", there}),
                 there +
                     " is there already; nothing was written: give another file, or --force to "
                     "replace it");
  EXPECT_EQ(content_of(there), "mine");
  EXPECT_EQ(sample("/Joy/cmd:o", {"-o", there, "--force"}).exit_code, 0);
  EXPECT_EQ(content_of(there), "not of Nav");
  EXPECT_EQ(sample("/Joy/cmd:o", {"-o", "/dev/null"}).exit_code, 0);
  EXPECT_EQ(sample("/Joy/cmd:o", {"-o", "-"}).out, "not of Nav");
  // Where a shell has led it: to a pipe, and behind what a file has already.
  EXPECT_EQ(sample("/Joy/cmd:o", {"-o", "/dev/stdout"}).out, "not of Nav");
  const auto appended = run_program({"/bin/bash", "-c",
                                     "exec " ARBITER_PROGRAMS "/arbiter recording sample " + file_ +
                                         " --source /Joy/cmd:o -o /dev/stdout >> " + there});
  EXPECT_EQ(appended.exit_code, 0) << appended.err;
  EXPECT_EQ(content_of(there), "not of Navnot of Nav");
}

TEST_F(RecordedSample, ThatIsNotThereIsRefusedWithTheReason) {
  expect_refusal(sample("/Nav/cmd"), "nothing of /Nav/cmd arrived; did you mean /Nav/cmd:o?");
  expect_refusal(sample("/signals"), "/signals only signalled: it has no samples");
  expect_refusal(sample("/none"), "is not recorded; record it with --payloads all");
  expect_refusal(sample("/Nav/cmd:o", {"--sequence", "6"}),
                 "/Nav/cmd:o has no sample 6 here: the first is 7, the last 9");
  expect_refusal(sample("/Nav/cmd:o", {"--sequence", "9"}),
                 "which came at 1970-01-01 "
                 "00:00:05.000, is not recorded");
  expect_refusal(sample("/again", {"--sequence", "1"}),
                 "has several samples 1, at 1970-01-01 00:00:06.000 and at 1970-01-01 "
                 "00:00:07.000; choose one by --at");
  expect_refusal(sample("/again", {"--at", "00:00:02"}), "by then no sample of /again had come");
  expect_refusal(sample("/again", {"--at", "00:10:00"}), "is not in the recording");
  for (const char* year : {"1600", "2554", "2611", "9999"}) {  // 2^64 ns are 584 years
    expect_refusal(sample("/again", {"--at", std::string(year) + "-07-21 23:34:39"}),
                   "is not in the recording");
  }
  expect_refusal(sample("/again", {"--at", "00:00:06", "--sequence", "1"}), "excludes");
}

TEST_F(RecordedSample, OfAFileThatIsCutShortIsReadAsFarAsItGoes) {
  const std::string whole = content_of(file_);
  file_ = directory_.write("cut.mcap", whole.substr(0, whole.size() / 3));
  const auto result = sample("/Nav/cmd:o");
  EXPECT_NE(result.exit_code, 0);
  EXPECT_THAT(result.err, HasSubstr("cut.mcap"));
}

}  // namespace
}  // namespace arbiter::test
