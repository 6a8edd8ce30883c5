// What gateways say: whole, with its level where a journal reads it, and never at the cost of the
// loop.
#include "gateway/core/say.hpp"

#include <gmock/gmock.h>

#include <fstream>
#include <string>
#include <vector>

#include "shm/file_descriptor.hpp"
#include "tests/support/child_process.hpp"
#include "tests/support/daemon.hpp"
#include "tests/support/full_pipe.hpp"
#include "tests/support/temporary_directory.hpp"
#include "tests/support/text_files.hpp"

namespace arbiter::test {
namespace {

using testing::HasSubstr;
using testing::StartsWith;

const std::string kChattyGateway = ARBITER_TESTS "/chatty_gateway";

// A program whose standard output is read, and whose standard error is another.
class Chatty {
 public:
  Chatty(const std::vector<std::string>& argv, int err) {
    int in[2];
    int out[2];
    if (::pipe2(in, O_CLOEXEC) != 0 || ::pipe2(out, O_CLOEXEC) != 0) {
      throw std::runtime_error("no pipe");
    }
    const shm::FileDescriptor their_in(in[0]);
    const shm::FileDescriptor their_out(out[1]);
    in_.reset(in[1]);
    out_.reset(out[0]);
    process = ChildProcess(argv, {}, {their_in.get(), their_out.get(), err});
  }
  // Returns once so many lines have come that contain `text`; false: it has ended before.
  bool hear(const std::string& text, int times = 1) {
    while (times > 0) {
      const auto end = read_.find('\n');
      if (end != std::string::npos) {
        if (read_.substr(0, end).find(text) != std::string::npos) --times;
        read_.erase(0, end + 1);
        continue;
      }
      char buffer[4096];
      const ssize_t size = ::read(out_.get(), buffer, sizeof buffer);
      if (size <= 0) return false;
      read_.append(buffer, static_cast<std::size_t>(size));
    }
    return true;
  }
  void end_input() { in_.reset(); }

  ChildProcess process;

 private:
  shm::FileDescriptor in_;
  shm::FileDescriptor out_;
  std::string read_;
};

// What it says there, and its exit code.
std::string said_to_file(std::vector<std::string> argv, const std::vector<std::string>& by,
                         int exit_code) {
  const TemporaryDirectory directory;
  const std::string path = directory.path() + "/log";
  const shm::FileDescriptor file(::open(path.c_str(), O_RDWR | O_CREAT | O_CLOEXEC, 0600));
  argv.insert(argv.begin(), by.begin(), by.end());
  ChildProcess process(argv, {{"JOURNAL_STREAM", "1:1"}}, {-1, -1, file.get()});
  EXPECT_EQ(process.wait(), exit_code);
  return content_of(path);
}

TEST(Say, AStandardErrorThatNobodyReadsStopsNoGateway) {
  const Daemon daemon(
      "<behaviors timeout='60s'><behavior name='Drive'>"
      "<config at='/Base/cmd:i'>/Nav/cmd:o</config></behavior></behaviors>");
  const std::string mapping = daemon.directory() + "/mapping.xml";
  std::ofstream(mapping) << "<gateway kind='dds'><out port='/Base/cmd:i' topic='/base' "
                            "type='a/msg/B' idle='zero' size='4'/></gateway>";
  const FullPipe unread;
  Chatty gateway({kChattyGateway, "--instance", daemon.instance(), mapping}, unread.write_end());
  EXPECT_TRUE(gateway.hear("sent", 20)) << "the robot is told to stop, again and again";
  gateway.process.signal(SIGTERM);
  EXPECT_EQ(gateway.process.wait(), 0);
}

TEST(Say, AStandardErrorThatNobodyReadsStopsNoSupervisor) {
  const FullPipe unread;
  Chatty supervisor({ARBITER_TESTS "/supervised_program", "crash", "600000", "600000"},
                    unread.write_end());
  EXPECT_TRUE(supervisor.hear("cleaned up after", 20)) << "it starts one worker after the other";
  supervisor.process.signal(SIGTERM);
  EXPECT_EQ(supervisor.process.wait(), 0);
}

TEST(Say, WhatWasLostIsCountedWhenSomebodyReadsAgain) {
  FullPipe pipe;
  Chatty program({kChattyGateway, "flood"}, pipe.write_end());
  ASSERT_TRUE(program.hear("said"));
  EXPECT_TRUE(pipe.read_until("arbiter-gateway: "));
  EXPECT_TRUE(pipe.read_until(" lines were lost here: nobody read the log\n"));
  program.end_input();
  EXPECT_EQ(program.process.wait(), 0);
}

// Whoever reads them may be slower than a line waits.
TEST(Say, TheLastWordsOfAProcessThatEndsItselfAreWritten) {
  FullPipe pipe;
  Chatty program({kChattyGateway, "last-words"}, pipe.write_end());
  ASSERT_TRUE(program.hear("said"));
  EXPECT_TRUE(pipe.read_until("arbiter-gateway: last-words\n"));
  EXPECT_EQ(program.process.wait(), 3);
}

TEST(Say, AJournalIsToldTheLevelAndAnythingElseTheProgramsName) {
  const std::vector<std::string> as_service = {
      "/bin/bash", "-c",
      "export JOURNAL_STREAM=$(stat -L -c %d:%i /dev/stderr) && exec \"$0\" \"$@\""};
  const std::vector<std::string> fails = {kChattyGateway, "/nowhere.xml"};
  EXPECT_THAT(said_to_file(fails, as_service, 2), StartsWith("<3>"));
  EXPECT_THAT(said_to_file(fails, {}, 2), StartsWith("chatty-gateway: "));
}

}  // namespace
}  // namespace arbiter::test
