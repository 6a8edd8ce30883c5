// A daemon that nobody asks anything uses no processor time: it sleeps, with no time set for
// waking.
#include <gtest/gtest.h>
#include <sys/syscall.h>

#include <filesystem>
#include <fstream>
#include <map>

#include <arbiter/arbiter.hpp>

#include "tests/support/daemon.hpp"
#include "tests/support/run_program.hpp"
#include "tests/support/threads.hpp"

namespace arbiter::test {
namespace {

std::vector<pid_t> tasks_of(pid_t process) {
  std::vector<pid_t> tasks;
  for (const auto& entry :
       std::filesystem::directory_iterator("/proc/" + std::to_string(process) + "/task")) {
    tasks.push_back(std::stoi(entry.path().filename()));
  }
  return tasks;
}

// Whether its loop waits with no time set for waking; true, too, where we are not told.
bool waits_for_ever(pid_t process) {
  std::ifstream file("/proc/" + std::to_string(process) + "/syscall");
  std::string call, epoll, events, count, timeout;
  file >> call >> epoll >> events >> count >> timeout;
  if (!file) return true;
  return timeout.size() >= 8 && timeout.substr(timeout.size() - 8) == "ffffffff";
}

// Until its loop sleeps with no time set for waking.
void wait_until_it_rests(pid_t process) {
  do {
    wait_until_it_sleeps_in(SYS_epoll_wait, process, process);
  } while (!waits_for_ever(process));
}

// It comes to rest, and none of its threads has been awake since, though much has gone on elsewhere
// meanwhile.
void expect_asleep(pid_t process) {
  wait_until_it_rests(process);
  const auto sleeps = [process] {
    std::map<pid_t, std::uint64_t> result;
    for (const pid_t task : tasks_of(process)) result[task] = sleeps_of(process, task);
    return result;
  };
  const auto before = sleeps();
  for (int i = 0; i < 20; ++i) EXPECT_EQ(run_program({"/bin/true"}).exit_code, 0);
  EXPECT_EQ(sleeps(), before);
}

TEST(Idle, ADaemonThatNobodyRegistersWithSleeps) {
  Daemon daemon;
  expect_asleep(daemon.process().pid());
}

TEST(Idle, ItSleepsWhileComponentsExchangeData) {
  Daemon daemon("<behaviors><arbiter at='/in'><select from='/out'/></arbiter></behaviors>");
  Node node("test");
  auto out = node.output_port<int>("/out");
  auto in = node.input_port<int>("/in");
  const pid_t process = daemon.process().pid();
  wait_until_it_rests(process);
  const auto before = sleeps_of(process, process);
  for (int i = 0; i < 10000; ++i) {
    EXPECT_EQ(out.publish(i).delivered, 1u);
    EXPECT_TRUE(in.take());
  }
  EXPECT_EQ(sleeps_of(process, process), before);
  expect_asleep(process);
}

TEST(Idle, ItSleepsAgainWhenEverybodyHasLeft) {
  Daemon daemon;
  for (int i = 0; i < 3; ++i) {
    Node node("test");
    auto out = node.output_port<int>("/out");
    auto in = node.input_port<int>("/in");
  }
  while (daemon.status()["clients"] != 1) {
  }
  expect_asleep(daemon.process().pid());
}

// Counts when nobody else is there and the daemon has nothing left to do.
std::size_t descriptors_at_rest(Daemon& daemon, RawClient& watcher) {
  while (watcher.status()["clients"] != 1) {
  }
  wait_until_it_rests(daemon.process().pid());
  return daemon.open_descriptors();
}

TEST(Idle, NoDescriptorIsLeftWhenEverybodyHasLeft) {
  Daemon daemon(
      "<behaviors><arbiter at='/in'><select from='/out'>not /stop</select></arbiter></behaviors>");
  RawClient watcher(daemon.instance());
  watcher.hello();
  const auto come_and_go = [&] {
    Node node("test");
    auto out = node.output_port<int>("/out");
    auto stop = node.output_port<int>("/stop");
    auto in = node.input_port<int>("/in");
    out.publish(1);
  };
  come_and_go();
  const auto before = descriptors_at_rest(daemon, watcher);
  for (int i = 0; i < 50; ++i) come_and_go();
  EXPECT_EQ(descriptors_at_rest(daemon, watcher), before);
}

TEST(Idle, NoDescriptorIsLeftOfPortsThatWereClosedOrRefused) {
  Daemon daemon;
  RawClient watcher(daemon.instance());
  watcher.hello();
  {
    Node node("test");
    auto out = node.output_port<int>("/out");
    auto in = node.input_port<int>("/in");
  }
  const auto before = descriptors_at_rest(daemon, watcher);
  {
    Node node("test");
    for (int i = 0; i < 50; ++i) {
      auto out = node.output_port<int>("/out");
      auto in = node.input_port<int>("/in");
      EXPECT_THROW(static_cast<void>(node.output_port<int>("/out")), Error);
    }
  }
  EXPECT_EQ(descriptors_at_rest(daemon, watcher), before);
}

TEST(Idle, AReloadLeavesNoDescriptorBehind) {
  Daemon daemon;
  RawClient watcher(daemon.instance());
  watcher.hello();
  const auto before = descriptors_at_rest(daemon, watcher);
  for (int i = 0; i < 20; ++i) daemon.load(kNoRules);
  EXPECT_EQ(descriptors_at_rest(daemon, watcher), before);
}

}  // namespace
}  // namespace arbiter::test
