// `arbiter record --ring`: the last minutes, when somebody asks.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>

#include <arbiter/arbiter.hpp>

#include "evidence/record_reader.hpp"
#include "tests/client/component.hpp"
#include "tests/recorder/recording.hpp"
#include "tests/support/full_pipe.hpp"

namespace arbiter::test {
namespace {

using testing::Each;
using testing::HasSubstr;
using testing::SizeIs;

class Flight : public testing::Test {
 protected:
  explicit Flight() : prefix_(daemon_.directory() + "/flight") {}
  // Returns once it runs. `out`: its standard output; -1: this one's.
  ChildProcess fly(std::vector<std::string> more = {}, int out = -1) {
    more.insert(more.begin(), {std::string(ARBITER_PROGRAMS) + "/arbiter", "record", "--ring",
                               "5min", "-o", prefix_});
    const std::string err = daemon_.directory() + "/flight.err";
    const shm::FileDescriptor file(
        ::open(err.c_str(), O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC, 0600));
    ChildProcess process(more, {}, {-1, out, file.get()});
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
  // A file that is asked for now.
  std::string dumped() {
    const std::string said = arbiter({"record", "--dump", "-o", prefix_}).out;
    return said.substr(said.find('/'), said.size() - said.find('/') - 1);
  }
  static bool has_died(const std::string& file) {
    bool has_died = false;
    evidence::read_recording(file, evidence::Payloads::pass_over, [&](evidence::Record&& record) {
      const auto* port = std::get_if<evidence::PortChange>(&record);
      if (port != nullptr) has_died |= port->what == evidence::PortChange::What::died;
    });
    return has_died;
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
  EXPECT_EQ(second.err, "arbiter: another flight recorder writes to " + prefix_ +
                            "; give another -o, or ask that one: arbiter record --dump -o " +
                            prefix_ + "\n");
  recorder.stop();
  for (int i = 0; i < 30; ++i) {  // more than there is room for at its door
    const auto late = arbiter({"record", "--dump", "-o", prefix_, "--timeout", "1ms"});
    EXPECT_EQ(late.exit_code, 1);
    EXPECT_THAT(late.err,
                HasSubstr("has not answered in time: it is stopped, or its disk is slow"));
  }
  recorder.resume();
  recorder.signal(SIGTERM);
  EXPECT_EQ(recorder.wait(), 0);
  EXPECT_FALSE(std::filesystem::exists(prefix_ + ".sock"));
  EXPECT_EQ(arbiter({"record", "--dump", "-o", prefix_}).exit_code, 1);
}

// As behind a pager, or where the collector of its lines is stopped.
TEST_F(Flight, GoesOnWhereNobodyReadsItsLines) {
  FullPipe pipe;
  ChildProcess recorder = fly({}, pipe.write_end());
  recorder.signal(SIGUSR1);
  wait_for_files(1);
  EXPECT_NE(dumped(), "");
  recorder.signal(SIGTERM);
  EXPECT_EQ(recorder.wait(), 0);
}

// As where the SSH session closes in which it was started.
TEST_F(Flight, EndsInGoodOrderAtAHangup) {
  ::signal(SIGHUP, SIG_DFL);  // what a test was started with, the program has too
  ChildProcess recorder = fly();
  EXPECT_TRUE(std::filesystem::exists(prefix_ + ".sock"));
  recorder.signal(SIGHUP);
  EXPECT_EQ(recorder.wait(), 0);
  EXPECT_FALSE(std::filesystem::exists(prefix_ + ".sock"));
}

TEST_F(Flight, WritesWhereAStatementBecomesTrue) {
  Node node("test");
  auto low = node.output_port<int>("/low");
  auto high = node.output_port<int>("/high");
  auto in = node.input_port<int>("/p");
  ChildProcess recorder = fly({"--when", "winner(/p) = /high and /low", "--after", "0s"});
  low.publish(1);
  high.publish(2);
  EXPECT_THAT(wait_for_files(1).at(0), HasSubstr("-when.mcap"));
  recorder.signal(SIGINT);
  EXPECT_EQ(recorder.wait(), 0);
}

TEST_F(Flight, WritesWhereAComponentDies) {
  Node node("test");
  auto in = node.input_port("/p");
  ChildProcess recorder = fly({"--after", "10ms"});
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

TEST_F(Flight, ShowsWhatCameOfADeath) {
  Node node("test");
  auto in = node.input_port("/p");
  auto high = node.output_port<int>("/high");
  ChildProcess recorder = fly({"--after", "60s"});
  Component component("arm");
  component.tell("output /low");
  component.tell("publish /low 1");
  component.kill();
  await([&] { return has_died(dumped()); });
  EXPECT_THAT(files_in(daemon_.directory()), Each(HasSubstr("-asked")));
  high.publish(2);
  recorder.signal(SIGINT);
  EXPECT_EQ(recorder.wait(), 0);
  const auto files = files_in(daemon_.directory());
  const auto death = std::find_if(files.begin(), files.end(), [](const std::string& file) {
    return file.find("-death.mcap") != std::string::npos;
  });
  ASSERT_NE(death, files.end());
  EXPECT_THAT(arbiter({"recording", "winners", *death}).out, HasSubstr("/high"));
}

// A name may be misspelt; or the model that has it is yet to come.
TEST_F(Flight, SaysWhichNameOfAStatementTheModelLacks) {
  ChildProcess recorder = fly({"--when", "/hihg"});
  const std::string file = daemon_.directory() + "/flight.err";
  std::string said;
  await([&] {
    said = content_of(file);
    return said.find("? --when waits for a model that has it\n") != std::string::npos;
  });
  EXPECT_THAT(said, HasSubstr("gives this condition no meaning: "));
  EXPECT_THAT(said, HasSubstr("/hihg"));
  recorder.signal(SIGINT);
  EXPECT_EQ(recorder.wait(), 0);
}

TEST_F(Flight, RefusesAStatementThatCannotBeRead) {
  const auto result = arbiter({"record", "--ring", "10s", "-o", prefix_, "--when", "and"});
  EXPECT_EQ(result.exit_code, 2);
  for (const char* empty : {"", " "}) {
    const auto refused = arbiter({"record", "--ring", "10s", "-o", prefix_, "--when", empty});
    EXPECT_EQ(refused.exit_code, 2);
    EXPECT_THAT(refused.err, HasSubstr("is empty"));
  }
  EXPECT_EQ(arbiter({"record", "--ring", "10s", "-o", prefix_, "--memory", "7"}).exit_code, 2);
}

}  // namespace
}  // namespace arbiter::test
