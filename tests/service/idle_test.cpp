// A daemon that nobody asks anything uses no processor time: it sleeps, with no time set for
// waking.
#include <fcntl.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <cstdint>
#include <map>
#include <memory>
#include <set>
#include <string>

#include <arbiter/arbiter.hpp>

#include "service/ports/closed_ports.hpp"
#include "tests/client/models.hpp"
#include "tests/support/await.hpp"
#include "tests/support/daemon.hpp"
#include "tests/support/raw_port.hpp"
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

// Its peer is told of each, and another has all the names at once.
TEST(Idle, NoDescriptorIsLeftOfAComponentThatHadManyPorts) {
  constexpr int kPorts = 200;
  std::string body;
  for (int i = 0; i < kPorts; ++i) {
    const std::string number = std::to_string(i);
    body += arbiter_at("/in" + number, select("/out" + number));
  }
  Daemon daemon(rules(body), {.max_descriptors = 4096});
  RawClient watcher(daemon.instance());
  watcher.hello();
  RawClient peer(daemon.instance());
  peer.hello("peer");
  int bell[2];
  ASSERT_EQ(::pipe2(bell, O_CLOEXEC), 0);
  const shm::FileDescriptor read(bell[0]);
  const shm::FileDescriptor written(bell[1]);
  const auto input = raw_input_segment();
  for (int i = 0; i < kPorts; ++i) {
    peer.send(RawClient::message(wire::MessageKind::kOpenInput, "/in" + std::to_string(i)),
              {input.get(), written.get()});
    peer.expect(wire::MessageKind::kConnected);
  }
  const auto output = raw_output_segment();
  const auto come_and_go = [&] {
    std::set<shm::PortInstance> gone;
    {
      RawClient many(daemon.instance());
      many.hello("many");
      for (int i = 0; i < kPorts; ++i) {
        gone.insert(open_raw_output(many, "/out" + std::to_string(i), output).message.port);
      }
    }
    while (!gone.empty()) gone.erase(peer.expect(wire::MessageKind::kPeerGone).message.peer);
    await([&] { return watcher.status()["clients"] == 2; });
    wait_until_all_rest(daemon.process().pid());
    return daemon.open_descriptors();
  };
  const std::size_t before = come_and_go();
  EXPECT_EQ(come_and_go(), before);
}

TEST(ClosedPorts, AreGivenUpInTurns) {
  service::ClosedPorts closed;
  const auto port = std::make_shared<int>();
  for (int i = 0; i < 3; ++i) closed.add(std::make_shared<std::shared_ptr<int>>(port));
  for (int left = 2; left >= 0; --left) {
    EXPECT_FALSE(closed.empty());
    closed.give_up(0);  // long past: one at least
    EXPECT_EQ(port.use_count(), 1 + left);
  }
  EXPECT_TRUE(closed.empty());
  for (int i = 0; i < 3; ++i) closed.add(std::make_shared<std::shared_ptr<int>>(port));
  closed.give_up(shm::kForever);
  EXPECT_EQ(port.use_count(), 1);
}

// A port leaves two at most: itself and a page.
TEST(ClosedPorts, AreGivenUpFasterThanOthersAreOpened) {
  service::ClosedPorts closed;
  const auto port = std::make_shared<int>();
  for (int i = 0; i < 100; ++i) {
    closed.make_room();
    for (int k = 0; k < 2; ++k) closed.add(std::make_shared<std::shared_ptr<int>>(port));
    EXPECT_LE(port.use_count(), 1 + 2);
  }
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
