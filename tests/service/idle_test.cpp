// A daemon that nobody asks anything uses no processor time: it sleeps, with no time set for
// waking.
#include <gtest/gtest.h>

#include <cstdint>
#include <map>

#include <arbiter/arbiter.hpp>

#include "tests/support/await.hpp"
#include "tests/support/daemon.hpp"
#include "tests/support/resting.hpp"
#include "tests/support/run_program.hpp"
#include "tests/support/threads.hpp"

namespace arbiter::test {
namespace {

// It comes to rest, and none of its threads has been awake since, though much has gone on elsewhere
// meanwhile.
void expect_asleep(pid_t process) {
  wait_until_all_rest(process);
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
  await([&] { return daemon.status()["clients"] == 1; });
  expect_asleep(daemon.process().pid());
}

// Counts when nobody else is there and the daemon has nothing left to do.
std::size_t descriptors_at_rest(Daemon& daemon, RawClient& watcher) {
  await([&] { return watcher.status()["clients"] == 1; });
  wait_until_all_rest(daemon.process().pid());
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
