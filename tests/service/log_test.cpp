// What stands in the log: nothing that a client has made up, no more than its user's share, and
// never at the cost of the loop.
#include "service/log/log.hpp"

#include <fcntl.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/resource.h>
#include <unistd.h>

#include <csignal>
#include <filesystem>
#include <iterator>
#include <sstream>
#include <thread>

#include "logging/log_writer.hpp"
#include "service/log/log_sink.hpp"
#include "tests/support/daemon.hpp"
#include "tests/support/raw_client.hpp"
#include "tests/support/text_files.hpp"

namespace arbiter::service {
namespace {

using logging::LogWriter;
using testing::HasSubstr;
using testing::Not;
using namespace std::chrono_literals;

constexpr LogShares::Time kStart{1h};

struct Pipe {
  Pipe() {
    int ends[2];
    if (::pipe2(ends, O_CLOEXEC) != 0) throw std::runtime_error("no pipe");
    read.reset(ends[0]);
    write.reset(ends[1]);
  }
  // All that was written, once nobody can write any more.
  std::string rest() {
    write.reset();
    std::string text;
    char buffer[4096];
    for (ssize_t size = 0; (size = ::read(read.get(), buffer, sizeof buffer)) > 0;) {
      text.append(buffer, static_cast<std::size_t>(size));
    }
    return text;
  }
  shm::FileDescriptor read, write;
};

// While it lives, no file grows beyond that size.
class FullDisk {
 public:
  explicit FullDisk(rlim_t size) : ignored_(::signal(SIGXFSZ, SIG_IGN)) {
    if (::getrlimit(RLIMIT_FSIZE, &before_) != 0) throw std::runtime_error("getrlimit");
    const rlimit small{size, before_.rlim_max};
    if (::setrlimit(RLIMIT_FSIZE, &small) != 0) throw std::runtime_error("setrlimit");
  }
  FullDisk(const FullDisk&) = delete;
  FullDisk& operator=(const FullDisk&) = delete;
  ~FullDisk() {
    ::setrlimit(RLIMIT_FSIZE, &before_);
    ::signal(SIGXFSZ, ignored_);
  }

 private:
  rlimit before_{};
  void (*ignored_)(int);
};

TEST(LogShares, AUserMayCauseABurstOfLinesAndThenOneForEachInterval) {
  LogShares shares;
  for (std::uint32_t i = 0; i < LogShares::kMaxBurst; ++i) ASSERT_TRUE(shares.take(1, kStart));
  EXPECT_FALSE(shares.take(1, kStart));
  EXPECT_FALSE(shares.take(1, kStart + LogShares::kInterval - 1ms));
  EXPECT_TRUE(shares.take(1, kStart + LogShares::kInterval));
  EXPECT_FALSE(shares.take(1, kStart + LogShares::kInterval));
  EXPECT_TRUE(shares.take(1, kStart + 2 * LogShares::kInterval));
}

TEST(LogShares, OneUsersLinesTakeNothingFromAnothers) {
  LogShares shares;
  for (std::uint32_t i = 0; i < 2 * LogShares::kMaxBurst; ++i) shares.take(1, kStart);
  EXPECT_TRUE(shares.take(2, kStart));
}

TEST(LogShares, WhatWasLeftOutIsToldOnceWhenThereIsRoomForALine) {
  LogShares shares;
  for (std::uint32_t i = 0; i < LogShares::kMaxBurst + 5; ++i) shares.take(1, kStart);
  EXPECT_FALSE(shares.next_left_out(kStart));
  const auto left_out = shares.next_left_out(kStart + LogShares::kInterval);
  ASSERT_TRUE(left_out);
  EXPECT_EQ(left_out->user, 1u);
  EXPECT_EQ(left_out->lines, 5u);
  EXPECT_FALSE(shares.take(1, kStart + LogShares::kInterval));  // that line was its own
}

TEST(LogShares, AClockThatIsSetBackStopsNobodyForLonger) {
  LogShares shares;
  for (std::uint32_t i = 0; i < LogShares::kMaxBurst; ++i) shares.take(1, kStart + 24h);
  EXPECT_FALSE(shares.take(1, kStart));
  EXPECT_TRUE(shares.take(1, kStart + LogShares::kInterval));
}

TEST(LogWriter, ALogThatNobodyReadsHoldsNobodyUpAndSaysWhatItLost) {
  Pipe pipe;
  LogWriter writer(pipe.write.get());
  const std::string line = std::string(99, 'x') + '\n';
  const std::size_t enough = (LogWriter::kMaxWaiting + (1 << 20)) / line.size();
  for (std::size_t i = 0; i < enough; ++i) writer.put(line);  // would block here
  EXPECT_FALSE(writer.finish(0ms));
}

// It would write what comes behind before what the first is still writing.
TEST(LogWriter, ThereIsNoSecondThreadOnceTheFirstWasLeft) {
  Pipe pipe;
  LogWriter writer(pipe.write.get());
  const std::string line(4096, 'x');
  for (std::size_t i = 0; i < LogWriter::kMaxWaiting / line.size(); ++i) writer.put(line);
  EXPECT_FALSE(writer.finish(0ms));
  const auto threads = [] {
    const std::filesystem::directory_iterator all("/proc/self/task");
    return std::distance(begin(all), end(all));
  };
  const auto before = threads();
  EXPECT_FALSE(writer.finish(0ms));
  EXPECT_EQ(threads(), before);
}

TEST(LogWriter, LinesThatWereLostAreCountedWhereTheyWouldHaveStood) {
  Pipe pipe;
  std::string text;
  std::size_t put = 0;
  std::thread reader;
  {
    LogWriter writer(pipe.write.get());
    const std::string line = std::string(99, 'x') + '\n';
    for (; put < 4 * LogWriter::kMaxWaiting / line.size(); ++put) writer.put(line);
    reader = std::thread([&] {
      char buffer[4096];
      for (ssize_t size = 0; (size = ::read(pipe.read.get(), buffer, sizeof buffer)) > 0;) {
        text.append(buffer, static_cast<std::size_t>(size));
      }
    });
    EXPECT_TRUE(writer.finish(60s));
  }
  pipe.write.reset();
  reader.join();
  std::size_t written = 0;
  std::size_t lost = 0;  // there may be room again in between, so it may be said more than once
  std::istringstream lines(text);
  for (std::string each; std::getline(lines, each);) {
    if (each.front() == 'x') {
      ++written;
      continue;
    }
    EXPECT_THAT(each, HasSubstr(" lines were lost here"));
    lost += std::stoul(each.substr(each.find(' ')));
  }
  EXPECT_LT(written, put);
  EXPECT_EQ(written + lost, put);
}

TEST(LogWriter, LinesThatAFileDoesNotTakeAreCountedOnceItTakesThem) {
  const test::TemporaryDirectory directory;
  const std::string path = directory.write("log", "");
  const shm::FileDescriptor file(::open(path.c_str(), O_WRONLY | O_APPEND | O_CLOEXEC));
  LogWriter writer(file.get());
  writer.put("one\n");
  {
    const FullDisk disk(6);
    writer.put("two\n");
    writer.put("three\n");
  }
  writer.put("four\n");
  writer.put("five\n");
  EXPECT_EQ(test::content_of(path),
            "one\ntw\n[log] 2 lines were lost here: the file took none\nfour\nfive\n");
}

TEST(LogWriter, WhatWasSaidIsWrittenBeforeItEnds) {
  Pipe pipe;
  {
    LogWriter writer(pipe.write.get());
    for (int i = 0; i < 100; ++i) writer.put("line " + std::to_string(i) + "\n");
  }
  EXPECT_THAT(pipe.rest(), HasSubstr("line 0\nline 1\n"));
}

TEST(LogSink, WhatOthersHaveSaidForgesNoLineAndSteersNoTerminal) {
  Pipe pipe;
  {
    log::logger logger("test",
                       std::make_shared<LogSink>(std::make_shared<LogWriter>(pipe.write.get())));
    logger.warn("node \"{}\" is here", "x\n[error] forged\x1b[2J\u009b");
  }
  const std::string text = pipe.rest();
  EXPECT_EQ(std::count(text.begin(), text.end(), '\n'), 1);
  EXPECT_THAT(text, HasSubstr("x\\n[error] forged\\x1b[2J\\xc2\\x9b"));
}

TEST(LogSink, LinesOfOneUserAreLeftOutAboveItsShareAndTheDaemonsOwnNever) {
  Pipe pipe;
  std::string text;
  std::thread reader;
  {
    LogSink sink(std::make_shared<LogWriter>(pipe.write.get()));
    reader = std::thread([&] {
      char buffer[4096];
      for (ssize_t size = 0; (size = ::read(pipe.read.get(), buffer, sizeof buffer)) > 0;) {
        text.append(buffer, static_cast<std::size_t>(size));
      }
    });
    const auto say = [&](const std::string& what, LogShares::Time now) {
      sink.log({now, {}, "test", spdlog::level::info, what});
    };
    {
      const LogAccount account(1234);
      for (std::uint32_t i = 0; i < LogShares::kMaxBurst + 3; ++i) say("flood", kStart);
    }
    say("our own", kStart);
    say("later", kStart + LogShares::kInterval);
  }
  pipe.write.reset();
  reader.join();
  EXPECT_THAT(text, HasSubstr("our own\n"));
  EXPECT_THAT(text, HasSubstr("3 lines about clients of user 1234 were left out"));
  EXPECT_LT(text.find("our own"), text.find("were left out"));
}

}  // namespace
}  // namespace arbiter::service

namespace arbiter::test {
namespace {

using testing::HasSubstr;
using testing::Not;

TEST(Log, NamesThatWouldMisleadItsReadersAreRefused) {
  Daemon daemon;
  for (const std::string name : {"/a\u009b2J", "/a\x1b", "/a\u202e", "/a\xff", "/a b"}) {
    RawClient client(daemon.instance());
    client.hello();
    client.send(RawClient::message(wire::MessageKind::kOpenOutput, name));
    EXPECT_THAT(client.expect_refusal(), HasSubstr(" in it")) << name;
  }
  RawClient client(daemon.instance());
  client.send(RawClient::hello_message("evil\u009b"));
  EXPECT_THAT(client.expect_refusal(), HasSubstr("an invisible character"));
}

// What anybody can do: ask for something that is refused, as often as there is time.
TEST(Log, AClientThatIsRefusedAllTheTimeDoesNotFillTheLog) {
  Daemon daemon;
  RawClient client(daemon.instance());
  client.hello("noisy");
  for (int i = 0; i < 5000; ++i) {
    client.send(RawClient::message(wire::MessageKind::kOpenOutput, "no slash"));
    client.expect_refusal();
  }
  const std::string log = daemon.log();
  const auto lines = std::count(log.begin(), log.end(), '\n');
  EXPECT_LT(lines, 3 * service::LogShares::kMaxBurst);
}

TEST(Log, AStandardErrorThatNobodyReadsDoesNotStopTheDaemon) {
  int ends[2];
  ASSERT_EQ(::pipe2(ends, O_CLOEXEC), 0);
  const shm::FileDescriptor unread(ends[0]);
  const shm::FileDescriptor log(ends[1]);
  // As full as it can be before the daemon starts.
  ASSERT_EQ(::fcntl(log.get(), F_SETFL, O_NONBLOCK), 0);
  const std::string page(4096, 'x');
  while (::write(log.get(), page.data(), page.size()) > 0) {
  }
  ASSERT_EQ(::fcntl(log.get(), F_SETFL, 0), 0);
  const TemporaryDirectory directory;
  const ScopedVariable runtime("XDG_RUNTIME_DIR", directory.path());
  const ScopedVariable own("RUNTIME_DIRECTORY", std::nullopt);
  NotifySocket notify(directory.path() + "/notify");
  ChildProcess daemon({arbiterd_path(), "--instance", "unread"}, {{"NOTIFY_SOCKET", notify.path()}},
                      {-1, -1, log.get()});
  ASSERT_TRUE(notify.wait_for("READY=1", daemon));
  RawClient client("unread");
  client.hello();
  EXPECT_EQ(client.status()["instance"], "unread");
  daemon.signal(SIGTERM);
  EXPECT_EQ(daemon.wait(), 0);
}

}  // namespace
}  // namespace arbiter::test
