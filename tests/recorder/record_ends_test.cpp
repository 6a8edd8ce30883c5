// How a recording ends, and what it is then: by itself, by a signal, or because it cannot go on.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>

#include <arbiter/arbiter.hpp>

#include "evidence/recorded.hpp"
#include "shm/clock.hpp"
#include "tests/client/component.hpp"
#include "tests/recorder/recording.hpp"
#include "tests/support/await.hpp"
#include "tests/support/full_pipe.hpp"

namespace arbiter::test {
namespace {

using evidence::Arrival;
using testing::AllOf;
using testing::HasSubstr;

TEST(Record, HasAWholeFileAfterAHangup) {
  ::signal(SIGHUP, SIG_DFL);  // what a test was started with, the program has too
  Daemon daemon(kOverrideModel);
  Node node("test");
  auto low = node.output_port<int>("/low");
  Recording recording(daemon);
  low.publish(1);
  EXPECT_EQ(recording.end(SIGHUP), 0) << recording.error();
  EXPECT_THAT(recording.output(), HasSubstr("1 arrival of "));
  const auto read = evidence::read_recording(recording.file(), evidence::Payloads::pass_over,
                                             [](evidence::Record&& /*any*/) {});
  EXPECT_TRUE(read.end.is_whole) << read.end.problem;
}

TEST(Record, EndsWhereNobodyReadsItsStandardError) {
  Daemon daemon(kLasting);
  const std::string file = daemon.directory() + "/unread.mcap";
  FullPipe pipe;
  ChildProcess recorder({std::string(ARBITER_PROGRAMS) + "/arbiter", "record", "-o", file}, {},
                        {-1, -1, pipe.write_end()});
  Node node("test");
  auto low = node.output_port<int>("/low");
  await([&] { return daemon.taps_of("/low") == 1; });
  recorder.signal(SIGTERM);
  EXPECT_EQ(recorder.wait(), 0);
}

TEST(Record, GoesOnAfterAHangupThatIsIgnored) {
  Daemon daemon(kOverrideModel);
  Node node("test");
  auto low = node.output_port<int>("/low");
  ::signal(SIGHUP, SIG_IGN);  // as nohup does
  Recording recording(daemon);
  ::signal(SIGHUP, SIG_DFL);
  recording.process().signal(SIGHUP);
  low.publish(1);
  recording.wait_for<Arrival>([](const auto&) { return true; });
  EXPECT_EQ(recording.end(), 0) << recording.error();
}

// It cannot have looked since.
TEST(Record, HasTheModelThatCameIntoForceWhileItWasStopped) {
  Daemon daemon(kOverrideModel);
  Recording recording(daemon);
  recording.process().signal(SIGSTOP);
  daemon.load(std::string(kOverrideModel) + "<!-- another -->");
  recording.process().signal(SIGINT);
  EXPECT_EQ(recording.end(SIGCONT), 0) << recording.error();
  const auto models = recording.records<evidence::ModelChange>();
  ASSERT_EQ(models.size(), 2U);
  EXPECT_EQ(models[1].generation, daemon.status()["model"]["generation"]);
}

// Nor has its tap been told of the port.
TEST(Record, HasWhatAPortDidThatWasOpenedWhileItWasStopped) {
  Daemon daemon(kLasting);
  Recording recording(daemon);
  recording.process().stop();
  Node node("test");
  auto low = node.output_port<int>("/low");
  constexpr std::uint64_t kSamples = 3;
  for (std::uint64_t i = 0; i < kSamples; ++i) low.publish(1);
  recording.process().signal(SIGINT);
  EXPECT_EQ(recording.end(SIGCONT), 0) << recording.error();
  const auto arrivals = recording.records<Arrival>();
  ASSERT_EQ(arrivals.size(), kSamples);
  const auto winners = recording.records<evidence::WinnerChange>();
  ASSERT_EQ(winners.size(), 1U);
  EXPECT_EQ(winners[0].winner, "/low");
  EXPECT_EQ(winners[0].time, arrivals[0].time);
  const auto ports = recording.records<evidence::PortChange>();
  ASSERT_EQ(ports.size(), 1U);
  EXPECT_EQ(ports[0].port, "/low");
  EXPECT_TRUE(recording.records<evidence::Missed>().empty());
}

// It reads the page long after.
TEST(Record, HasTheTimeAtWhichAnOperatorDeactivatedWhileItWasStopped) {
  Daemon daemon(kLasting);
  Node node("test");
  auto low = node.output_port<int>("/low");
  {
    auto high = node.output_port<int>("/high");
    high.publish(1);
  }
  Recording recording(daemon);
  recording.process().stop();
  EXPECT_EQ(arbiter({"deactivate", "/high"}).exit_code, 0);
  low.publish(1);
  recording.process().signal(SIGINT);
  EXPECT_EQ(recording.end(SIGCONT), 0) << recording.error();
  const auto winners = recording.records<evidence::WinnerChange>();
  ASSERT_EQ(winners.size(), 3U);
  EXPECT_EQ(winners[0].winner, "/high");
  EXPECT_EQ(winners[1].winner, "");
  EXPECT_EQ(winners[1].why, evidence::WinnerChange::Why::deactivation);
  EXPECT_EQ(winners[2].winner, "/low");
  EXPECT_EQ(winners[2].why, evidence::WinnerChange::Why::arrival);
}

// Of a name that nobody has had, there is no tap yet.
TEST(Record, SaysThatItMissedWhatANewSourceDidBeforeItWasFound) {
  Daemon daemon(kLasting);
  Recording recording(daemon);
  const shm::Nanoseconds before = shm::monotonic_now();
  recording.process().stop();
  Node node("test");
  auto port = node.output_port<int>("/new");
  port.publish(1);
  const shm::Nanoseconds after = shm::monotonic_now();
  recording.process().signal(SIGINT);
  EXPECT_EQ(recording.end(SIGCONT), 0) << recording.error();
  const auto missed = recording.records<evidence::Missed>();
  ASSERT_EQ(missed.size(), 1U);
  EXPECT_EQ(missed[0].source, "/new");
  EXPECT_EQ(missed[0].events, 1U);
  EXPECT_LT(missed[0].from, after);
  EXPECT_GT(missed[0].to, before);
  EXPECT_THAT(recording.output(), HasSubstr("missed 1 event,"));
}

TEST(Record, IsReadUpToTheLastChunkAfterAKill) {
  Daemon daemon(kOverrideModel);
  Node node("test");
  auto low = node.output_port<int>("/low");
  auto in = node.input_port<int>("/p");
  Recording recording(daemon);
  for (int i = 0; i < 10; ++i) low.publish(i);
  recording.wait_for<Arrival>([](const auto& each) { return each.sequence == 10; });
  recording.process().kill();
  const auto result = arbiter({"simulate", "--recording", recording.file()});
  EXPECT_EQ(result.exit_code, 0) << result.err;
  EXPECT_THAT(result.err, HasSubstr("what comes before is used"));
  EXPECT_THAT(result.out, HasSubstr("10 decisions: 10 equal"));
}

TEST(Record, SaysThatTheDiskIsFullAndLeavesWhatIsWhole) {
  Daemon daemon(kLasting);
  Node node("test");
  auto low = node.output_port("/low", OutputPortOptions{.max_size = 4096});
  auto in = node.input_port("/p");
  const std::string file = daemon.directory() + "/full.mcap";
  const std::string err = daemon.directory() + "/full.err";
  const shm::FileDescriptor errors(
      ::open(err.c_str(), O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC, 0600));
  const std::string command = std::string("ulimit -f 4000 && exec ") + ARBITER_PROGRAMS +
                              "/arbiter record --payloads all --compression none -o " + file;
  ChildProcess recorder({"/bin/bash", "-c", command}, {}, {-1, -1, errors.get()});
  pollfd ended{recorder.descriptor(), POLLIN, 0};
  const std::vector<std::byte> sample(4096);
  while (::poll(&ended, 1, 0) == 0) {
    low.publish(Bytes(sample.data(), sample.size()));
    ::usleep(100);
  }
  EXPECT_EQ(recorder.wait(), 2);
  EXPECT_THAT(content_of(err), HasSubstr(file));
  const auto result = arbiter({"simulate", "--recording", file});
  EXPECT_EQ(result.exit_code, 0) << result.out << result.err;
  EXPECT_THAT(result.out, HasSubstr("every decision is reproduced"));
}

TEST(Record, SaysThatItsFileWasDeletedMeanwhile) {
  Daemon daemon(kLasting);
  Recording recording(daemon);
  std::filesystem::remove(recording.file());
  EXPECT_EQ(recording.end(), 2);
  EXPECT_THAT(recording.error(), AllOf(HasSubstr(recording.file()), HasSubstr("deleted it")));
  EXPECT_EQ(recording.output(), "");
}

// A lease that was taken long ago still counts when recording ends.
TEST(Record, SaysUntilWhenItWasRecorded) {
  Daemon daemon(kLasting);
  Node node("test");
  auto low = node.output_port<int>("/low");
  Recording recording(daemon);
  low.publish(1);
  recording.wait_for<Arrival>([](const auto&) { return true; });
  const shm::Nanoseconds later = shm::monotonic_now();
  // The file of one that is killed says nothing of its end.
  EXPECT_LT(evidence::load_recording(recording.file()).runs.at(0).end, later);
  EXPECT_EQ(recording.end(), 0) << recording.error();
  EXPECT_GT(evidence::load_recording(recording.file()).runs.at(0).end, later);
}

TEST(Record, EndsByItselfAfterADuration) {
  Daemon daemon(kOverrideModel);
  const std::string file = daemon.directory() + "/short.mcap";
  const auto result = arbiter({"record", "-o", file, "--duration", "20ms"});
  EXPECT_EQ(result.exit_code, 0) << result.err;
  EXPECT_THAT(result.out, HasSubstr("0 arrivals of 0 sources and 0 changes of winner"));
}

}  // namespace
}  // namespace arbiter::test
