// A publisher whose memory lies to the recorder takes nobody's recording away.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <limits>
#include <numeric>
#include <string>
#include <vector>

#include <arbiter/arbiter.hpp>

#include "evidence/record_writer.hpp"
#include "tests/recorder/recording.hpp"
#include "tests/support/raw_publisher.hpp"

namespace arbiter::test {
namespace {

using evidence::SourceState;
using testing::HasSubstr;
using testing::SizeIs;

// No clock has shown them.
constexpr shm::Nanoseconds kNoTimes[]{-5, std::numeric_limits<shm::Nanoseconds>::min(),
                                      shm::kForeverFlag - 1,
                                      std::numeric_limits<shm::Nanoseconds>::max()};

// Deactivated, or active for ever, since such times; the last is what an honest one may write.
constexpr shm::ActivityWord kNoWords[]{-1, shm::kDeactivatedFlag | shm::kForeverFlag | 5,
                                       std::numeric_limits<shm::ActivityWord>::max(),
                                       shm::kDeactivatedFlag};

// No model has it.
constexpr auto kNoGeneration = std::numeric_limits<std::uint64_t>::max();

std::uint64_t missed_events(const Recording& recording) {
  const auto all = recording.records<evidence::Missed>();
  return std::accumulate(
      all.begin(), all.end(), std::uint64_t{0},
      [](std::uint64_t sum, const evidence::Missed& each) { return sum + each.events; });
}

// By all that reads a recording.
void expect_readable(const std::string& file) {
  for (const std::vector<std::string>& reads : std::vector<std::vector<std::string>>{
           {"simulate", "--recording", file}, {"recording", "winners", file}}) {
    const auto result = arbiter(reads);
    EXPECT_EQ(result.exit_code, 0) << result.out << result.err;
  }
}

class Hostile : public testing::Test {
 protected:
  void tell_all_lies() {
    shm::write_destinations(high_.events(), 1, {{1, "/\xff"}});
    for (const shm::Nanoseconds time : kNoTimes) high_.signal_at(time);
    high_.signal_at(shm::monotonic_now(), 1);
    high_.signal_at(shm::monotonic_now(), 1, kNoGeneration);
  }

  Daemon daemon_{kLasting};
  Node node_{"test"};
  InputPort<int> in_ = node_.input_port<int>("/p");
  OutputPort<int> low_ = node_.output_port<int>("/low");
  RawPublisher high_{daemon_.instance(), "/high"};
};

TEST_F(Hostile, PublisherMakesNoRecordingUnreadable) {
  Recording recording(daemon_);
  low_.publish(1);
  high_.admit();
  tell_all_lies();
  recording.wait_for<evidence::Arrival>(
      [](const auto& each) { return each.generation == kNoGeneration; });
  EXPECT_EQ(recording.end(), 0) << recording.error();
  expect_readable(recording.file());
  EXPECT_THAT(recording.records<evidence::Arrival>(), SizeIs(3));
  EXPECT_EQ(missed_events(recording), std::size(kNoTimes)) << "what was not believed";
  EXPECT_THAT(recording.output(), HasSubstr("missed 4 events"));
}

TEST_F(Hostile, PublisherDoesNotLeadAFlightRecorderIntoTheFuture) {
  const std::string prefix = daemon_.directory() + "/flight";
  const std::string said = daemon_.directory() + "/flight.err";
  const shm::FileDescriptor err(
      ::open(said.c_str(), O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC, 0600));
  ChildProcess recorder(
      {std::string(ARBITER_PROGRAMS) + "/arbiter", "record", "--ring", "5min", "-o", prefix}, {},
      {-1, -1, err.get()});
  high_.admit();
  await([&] { return content_of(said).find("keeping the last") != std::string::npos; });
  tell_all_lies();
  low_.publish(1);
  EXPECT_EQ(arbiter({"record", "--dump", "-o", prefix}).exit_code, 0);
  const auto files = files_in(daemon_.directory());
  ASSERT_THAT(files, SizeIs(1));
  expect_readable(files[0]);
  const auto now = static_cast<std::uint64_t>(evidence::wall_offset_now() + shm::monotonic_now());
  recording::McapVisitor visitor;
  visitor.message = [&](const recording::McapMessage& message) {
    EXPECT_LE(message.log_time, now);
  };
  read_mcap(files[0], visitor);
  recorder.signal(SIGINT);
  EXPECT_EQ(recorder.wait(), 0);
}

// Its page is read where no tap tells of it.
TEST_F(Hostile, PageMakesNoRecordingUnreadable) {
  for (const shm::ActivityWord word : kNoWords) {
    high_.activity().word.store(word);
    Recording recording(daemon_);
    low_.publish(1);
    EXPECT_EQ(recording.end(), 0) << recording.error();
    expect_readable(recording.file());
    for (const SourceState& state : recording.records<SourceState>()) {
      if (state.context->source != "/high") continue;
      EXPECT_EQ(shm::is_active(state.word, state.seen), word > 0) << "as the others see it";
      EXPECT_LE(shm::time_of(state.word, shm::kForever), state.seen);
    }
    std::filesystem::remove(recording.file());
  }
}

// It is not read any more, and the file says where.
TEST_F(Hostile, PublisherThatIsGivenUpHasAnEndInTheFile) {
  Recording recording(daemon_);
  high_.admit();
  high_.signal_at(shm::monotonic_now());
  shm::EventRecord no_event;
  no_event.kind = static_cast<shm::EventKind>(99);
  high_.write(no_event);
  recording.wait_for<SourceState>([](const SourceState& state) {
    return state.context->source == "/high" && state.why == SourceState::Why::closed;
  });
  EXPECT_EQ(recording.end(), 0) << recording.error();
  EXPECT_EQ(missed_events(recording), 1u);
  EXPECT_THAT(recording.error(), HasSubstr("/high cannot be watched"));
}

}  // namespace
}  // namespace arbiter::test
