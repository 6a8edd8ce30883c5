// How verbs end at Ctrl-C: with 0 where they go on until somebody stops them. Those that have an
// end of their own, and are stopped before it, are in play_test.cpp and wait_test.cpp.
#include <fcntl.h>
#include <gtest/gtest.h>
#include <sys/stat.h>

#include <csignal>
#include <cstdlib>
#include <filesystem>
#include <string>
#include <thread>
#include <vector>

#include "shm/file_descriptor.hpp"
#include "tests/support/child_process.hpp"
#include "tests/support/daemon.hpp"
#include "tests/support/temporary_directory.hpp"
#include "tests/support/text_files.hpp"

namespace arbiter::test {
namespace {

TEST(Interrupts, EndAVerbThatGoesOnUntilThenInGoodOrder) {
  Daemon daemon("<behaviors><arbiter at='/p'><select from='/s'/></arbiter></behaviors>");
  const TemporaryDirectory files;
  const std::vector<std::vector<std::string>> verbs{
      {"echo", "/p"},
      {"echo", "/p", "--rate"},
      {"pub", "/s"},
      {"record", "-o", files.path() + "/r.mcap"},
      {"record", "--ring", "5s", "-o", files.path() + "/flight"},
      {"winners"},
      {"metrics", "--listen", "127.0.0.1:0"},
      {"why", "/p", "--follow"},
  };
  int number = 0;
  for (const auto& verb : verbs) {
    for (const int signal : {SIGINT, SIGTERM}) {
      const std::string output = files.path() + "/output" + std::to_string(++number);
      const shm::FileDescriptor out(
          ::open(output.c_str(), O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC, 0600));
      std::vector<std::string> arguments{ARBITER_PROGRAMS "/arbiter"};
      arguments.insert(arguments.end(), verb.begin(), verb.end());
      ChildProcess process(arguments, {}, {-1, out.get(), out.get()});
      // Before its first word it has made up its mind about signals.
      while (std::filesystem::file_size(output) == 0) std::this_thread::yield();
      process.signal(signal);
      EXPECT_EQ(process.wait(), 0) << verb.front() << " at signal " << signal;
      std::filesystem::remove(files.path() + "/r.mcap");
    }
  }
}

// Which takes minutes for hundreds of behaviours.
TEST(Interrupts, EndAPictureThatIsFollowedAlsoWhileGraphvizIsAtWork) {
  Daemon daemon("<behaviors><arbiter at='/p'><select from='/s'/></arbiter></behaviors>");
  const TemporaryDirectory files;
  const std::string started = files.path() + "/started", gate = files.path() + "/gate";
  ASSERT_EQ(::mkfifo(gate.c_str(), 0600), 0);
  const std::string dot =
      files.write("dot", "#!/bin/sh\necho $$ > " + started + ".new\nmv " + started + ".new " +
                             started + "\nread line < " + gate + "\n");
  std::filesystem::permissions(dot, std::filesystem::perms::owner_all);
  const std::string path = files.path() + ":" + std::getenv("PATH");
  for (const int signal : {SIGINT, SIGTERM, SIGHUP}) {
    std::filesystem::remove(started);
    ChildProcess process(
        {ARBITER_PROGRAMS "/arbiter", "graph", "--follow", "-o", files.path() + "/now.svg"},
        {{"PATH", path}}, {});
    while (!std::filesystem::exists(started)) std::this_thread::yield();
    process.signal(signal);
    EXPECT_EQ(process.wait(), 0) << signal;
    EXPECT_EQ(::kill(std::stoi(content_of(started)), 0), -1) << "Graphviz goes on";
  }
}

}  // namespace
}  // namespace arbiter::test
