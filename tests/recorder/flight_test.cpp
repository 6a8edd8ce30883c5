// `arbiter record --ring`: the last minutes, when somebody asks.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <memory>

#include <arbiter/arbiter.hpp>

#include "evidence/verification.hpp"
#include "recorder/pipeline.hpp"
#include "recorder/ring.hpp"
#include "shm/clock.hpp"
#include "tests/client/component.hpp"
#include "tests/evidence/incident.hpp"
#include "tests/recorder/recording.hpp"

namespace arbiter::test {
namespace {

using testing::HasSubstr;
using testing::SizeIs;

std::vector<std::string> files_in(const std::string& directory) {
  std::vector<std::string> files;
  for (const auto& each : std::filesystem::directory_iterator(directory)) {
    if (each.path().extension() == ".mcap") files.push_back(each.path().string());
  }
  std::sort(files.begin(), files.end());
  return files;
}

// The ring alone, fed with an incident that was made up.
class RingTest : public testing::Test {
 protected:
  recorder::RingOptions options(evidence::Nanoseconds span, std::size_t memory) {
    recorder::RingOptions options;
    options.span = span;
    options.memory = memory;
    options.prefix = directory_.path() + "/flight";
    options.told = [this](const std::string& file, const std::string& error) {
      EXPECT_EQ(error, "");
      written_.push_back(file);
    };
    return options;
  }
  // All of it, and a file.
  evidence::Recorded dump(recorder::Ring& ring, const Incident& incident) {
    for (const auto& record : incident.records()) {
      ring.write(std::make_shared<const evidence::Record>(record));
    }
    ring.request("test");
    ring.finish();
    return evidence::load_recording(written_.back());
  }

  TemporaryDirectory directory_;
  std::vector<std::string> written_;
};

TEST_F(RingTest, WritesAllThatItHasIfNothingHasLeft) {
  Incident incident;
  incident.arrive("/low", 1010, 1011, Incident::Fate::accepted);
  recorder::Ring ring(options(1'000'000, 1 << 20));
  const auto recorded = dump(ring, incident);
  ASSERT_THAT(recorded.runs, SizeIs(1));
  EXPECT_EQ(recorded.runs[0].start, 1000);
  EXPECT_THAT(recorded.runs[0].decisions, SizeIs(1));
}

TEST_F(RingTest, BeginsWithTheStateOfAllThatHasLeft) {
  Incident incident;
  incident.arrive("/high", 1100, 1105, Incident::Fate::accepted);
  incident.arrive("/low", 1110, 1111, Incident::Fate::discarded);
  for (int i = 0; i < 10; ++i) {
    incident.arrive("/low", 1200 + i * 20, 1201 + i * 20, Incident::Fate::discarded);
  }
  recorder::Ring ring(options(100, 1 << 20));
  const auto recorded = dump(ring, incident);
  ASSERT_THAT(recorded.runs, SizeIs(1));
  const auto& run = recorded.runs[0];
  EXPECT_GE(run.start, 1240);
  EXPECT_LE(run.decisions.size(), 6u);
  EXPECT_EQ(run.sources.at("/high").steps.at(0).word, shm::arrival(1100, 500));
  evidence::Models models(compile_texts);
  const auto result = verify(recorded, models);
  EXPECT_EQ(result.equal, run.decisions.size());
}

TEST_F(RingTest, ATimeInTheFutureForgetsNothing) {
  recorder::Ring ring(options(1'000'000'000, 1 << 20));
  const evidence::Nanoseconds now = shm::monotonic_now();
  Incident incident;
  incident.arrive("/low", now - 1'000'000, now - 999'999, Incident::Fate::accepted);
  incident.arrive("/high", now + 3600'000'000'000, now + 3600'000'000'000,
                  Incident::Fate::accepted);
  EXPECT_THAT(dump(ring, incident).runs.at(0).decisions, SizeIs(2));
}

TEST_F(RingTest, PortsOfAnEarlierDaemonAreForgotten) {
  recorder::Ring ring(options(10, 1 << 20));
  Incident incident;
  evidence::PortChange port;
  port.port = "/gone";
  port.seen = 1001;
  incident.add(port);
  incident.add(evidence::Start{5000, "", {}, "none"});
  incident.arrive("/low", 6000, 6001, Incident::Fate::accepted);
  incident.arrive("/low", 7000, 7001, Incident::Fate::accepted);
  dump(ring, incident);
  evidence::read_recording(written_.back(), evidence::Payloads::pass_over,
                           [](const evidence::Record& record) {
                             EXPECT_FALSE(std::holds_alternative<evidence::PortChange>(record));
                           });
}

// Each source's records keep their order; what bears a later time than now waits for now only.
TEST(TimeOrder, HoldsNothingBackForAClockThatIsWrong) {
  recorder::TimeOrder order;
  const auto context = std::make_shared<evidence::SourceContext>();
  const auto add = [&](evidence::Nanoseconds time) {
    evidence::Arrival arrival;
    arrival.context = context;
    arrival.time = time;
    order.add(std::make_shared<const evidence::Record>(arrival), 100);
  };
  add(1'000'000);
  add(50);
  std::vector<evidence::Nanoseconds> times;
  order.take_before(
      101, [&](const evidence::RecordPtr& record) { times.push_back(evidence::time_of(*record)); });
  EXPECT_EQ(times, (std::vector<evidence::Nanoseconds>{1'000'000, 50}));
}

TEST_F(RingTest, IsBoundedByBytes) {
  recorder::Ring ring(options(1'000'000'000, 64 << 10));
  Incident incident;
  for (int i = 0; i < 2000; ++i) {
    incident.arrive("/low", 2000 + i * 10, 2001 + i * 10, Incident::Fate::accepted);
  }
  const auto recorded = dump(ring, incident);
  EXPECT_LE(ring.bytes(), 64u << 10);
  EXPECT_GT(recorded.runs.at(0).decisions.size(), 50u);
  EXPECT_EQ(recorded.runs[0].decisions.back().arrival().time, 2000 + 1999 * 10);
  evidence::Models models(compile_texts);
  EXPECT_EQ(verify(recorded, models).different, 0u);
}

class Flight : public testing::Test {
 protected:
  explicit Flight() : prefix_(daemon_.directory() + "/flight") {}
  // Returns once it runs.
  ChildProcess fly(std::vector<std::string> more = {}) {
    more.insert(more.begin(), {std::string(ARBITER_PROGRAMS) + "/arbiter", "record", "--ring",
                               "5min", "-o", prefix_});
    const std::string err = daemon_.directory() + "/flight.err";
    const shm::FileDescriptor file(
        ::open(err.c_str(), O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC, 0600));
    ChildProcess process(more, {}, {-1, -1, file.get()});
    pollfd ended{process.descriptor(), POLLIN, 0};
    while (content_of(err).find("keeping the last") == std::string::npos) {
      if (::poll(&ended, 1, 1) == 1) throw std::runtime_error("it has ended: " + content_of(err));
    }
    return process;
  }
  // Returns once there are so many.
  std::vector<std::string> wait_for_files(std::size_t count) {
    for (;;) {
      const auto files = files_in(daemon_.directory());
      const auto is_whole = [](const std::string& file) {
        return recording::read_mcap(file, {}).is_whole;
      };
      if (files.size() >= count && std::all_of(files.begin(), files.end(), is_whole)) return files;
    }
  }
  void expect_reproduced(const std::string& file, const std::string& decisions) {
    const auto result = arbiter({"simulate", "--recording", file});
    EXPECT_EQ(result.exit_code, 0) << result.out << result.err;
    EXPECT_THAT(result.out, HasSubstr(decisions));
  }

  Daemon daemon_{kLasting};
  const std::string prefix_;
};

TEST_F(Flight, WritesWhereItIsAsked) {
  Node node("test");
  auto low = node.output_port<int>("/low");
  auto in = node.input_port<int>("/p");
  ChildProcess recorder = fly();
  low.publish(1);
  low.publish(2);
  const auto result = arbiter({"record", "--dump", "-o", prefix_});
  EXPECT_EQ(result.exit_code, 0) << result.err;
  EXPECT_THAT(result.out, HasSubstr("written " + prefix_ + "-"));
  const auto files = wait_for_files(1);
  expect_reproduced(files.at(0), "2 decisions: 2 equal");
  recorder.signal(SIGUSR1);
  wait_for_files(2);
  const auto second = arbiter({"record", "--ring", "10s", "-o", prefix_});
  EXPECT_EQ(second.exit_code, 1);
  EXPECT_EQ(second.err, "arbiter: another flight recorder writes to " + prefix_ + "\n");
  recorder.signal(SIGTERM);
  EXPECT_EQ(recorder.wait(), 0);
  EXPECT_FALSE(std::filesystem::exists(prefix_ + ".sock"));
  EXPECT_EQ(arbiter({"record", "--dump", "-o", prefix_}).exit_code, 1);
}

TEST_F(Flight, WritesWhereAStatementBecomesTrue) {
  Node node("test");
  auto low = node.output_port<int>("/low");
  auto high = node.output_port<int>("/high");
  auto in = node.input_port<int>("/p");
  ChildProcess recorder = fly({"--when", "winner(/p) = /high and /low"});
  low.publish(1);
  high.publish(2);
  EXPECT_THAT(wait_for_files(1).at(0), HasSubstr("-when.mcap"));
  recorder.signal(SIGINT);
  EXPECT_EQ(recorder.wait(), 0);
}

TEST_F(Flight, WritesWhereAComponentDies) {
  Node node("test");
  auto in = node.input_port("/p");
  ChildProcess recorder = fly();
  {
    auto closed = node.output_port<int>("/high");  // in good order: no reason to write
    closed.signal();
  }
  Component component("arm");
  component.tell("output /low");
  component.tell("publish /low 1");
  component.kill();
  const auto files = wait_for_files(1);
  EXPECT_THAT(files, SizeIs(1));
  EXPECT_THAT(files.at(0), HasSubstr("-death.mcap"));
  recorder.signal(SIGINT);
  EXPECT_EQ(recorder.wait(), 0);
}

TEST_F(Flight, RefusesAStatementThatCannotBeRead) {
  const auto result = arbiter({"record", "--ring", "10s", "-o", prefix_, "--when", "and"});
  EXPECT_EQ(result.exit_code, 2);
  EXPECT_EQ(arbiter({"record", "--ring", "10s", "-o", prefix_, "--memory", "7"}).exit_code, 2);
}

}  // namespace
}  // namespace arbiter::test
