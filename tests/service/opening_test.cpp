// Ports that are opened while there is no daemon, one that does not answer, or a component that
// does not.
#include <gtest/gtest.h>
#include <sys/syscall.h>

#include <atomic>
#include <chrono>
#include <string>
#include <thread>

#include <arbiter/arbiter.hpp>

#include "shm/bell.hpp"
#include "tests/client/models.hpp"
#include "tests/client/samples.hpp"
#include "tests/service/impatient.hpp"
#include "tests/support/await.hpp"
#include "tests/support/daemon.hpp"
#include "tests/support/raw_port.hpp"
#include "tests/support/threads.hpp"

namespace arbiter::test {
namespace {

using wire::MessageKind;

TEST(Takeover, OpeningWaitsForADaemon) {
  Daemon daemon(single_model());
  std::atomic<bool> is_killed{false};  // before, one that is slow to answer may be waited for
  const auto patient = [&is_killed](std::atomic<int>& told) {
    NodeOptions options;
    options.connect_timeout = std::chrono::hours(1);
    options.on_waiting = [&told, &is_killed](const std::string& text) {
      if (!is_killed) return;
      EXPECT_NE(text.find("waits for an arbiterd of instance \"test\""), std::string::npos) << text;
      ++told;
    };
    return options;
  };
  std::atomic<int> early_told{0};
  std::atomic<int> late_told{0};
  Node node("early", patient(early_told));
  daemon.kill();
  is_killed = true;
  std::thread opener([&] { auto out = node.output_port<Number>("/out"); });
  std::thread starter([&] { Node("late", patient(late_told)); });
  while (early_told == 0 || late_told == 0) {
  }
  daemon.restart();
  opener.join();
  starter.join();
  EXPECT_EQ(early_told, 1);
  EXPECT_EQ(late_told, 1);
}

TEST(Takeover, OpeningWithoutADaemonEndsInTime) {
  Daemon daemon(single_model());
  Node node = impatient_node("test");
  daemon.kill();
  try {
    auto out = node.output_port<Number>("/out");
    FAIL();
  } catch (const Error& error) {
    EXPECT_NE(std::string(error.what()).find("no arbiterd of instance \"test\" answered"),
              std::string::npos)
        << error.what();
  }
  daemon.restart();
  auto out = at_last([&] { return node.output_port<Number>("/out"); });
}

TEST(Takeover, OpeningWhileTheDaemonIsStoppedEndsInTime) {
  Daemon daemon(single_model());
  Node node = impatient_node("test");
  daemon.process().stop();
  try {
    auto out = node.output_port<Number>("/out");
    FAIL();
  } catch (const Error& error) {
    EXPECT_STREQ(error.what(), "the daemon is there, but has not answered in time");
  }
  daemon.process().signal(SIGCONT);
  // What it opens too late is closed again.
  auto out = at_last([&] { return node.output_port<Number>("/other"); });
  await([&] { return daemon.source("/out")["open"] != true; });
}

void answer_sync(RawClient& client, const wire::Message& sync) {
  auto synced = RawClient::message(MessageKind::kSynced);
  synced.request = sync.request;
  client.send(synced);
}

// The instance of an output port that is open then.
shm::PortInstance open_in_step(RawClient& client, const std::string& name,
                               const shm::FileDescriptor& segment) {
  client.send(RawClient::message(MessageKind::kOpenOutput, name), {segment.get(), -1});
  shm::PortInstance port = 0;
  for (wire::Received received; client.receive(received);) {
    if (received.message.kind == MessageKind::kOpened) port = received.message.port;
    if (received.message.kind == MessageKind::kSync) answer_sync(client, received.message);
    if (received.message.kind == MessageKind::kConnected) break;
  }
  return port;
}

TEST(Introductions, ShowASegmentOnceItsOwnPublisherHasMadeRoom) {
  Daemon daemon(
      "<behaviors><arbiter at='/in' conflict='first'><select from='/slow'/><select from='/fast'/>"
      "</arbiter></behaviors>");
  const auto segment = raw_output_segment();
  const auto inbox = raw_input_segment();
  const shm::Bell bell;
  RawClient slow(daemon.instance()), receiver(daemon.instance()), fast(daemon.instance());
  slow.hello("slow", wire::kHasServiceThread);
  receiver.hello("receiver");
  fast.hello("fast");
  const auto slow_port = open_in_step(slow, "/slow", segment);
  // Both at once, lest the daemon has waited for the slow one long enough.
  wait_until_it_sleeps_in(SYS_epoll_wait, daemon.process().pid(), daemon.process().pid());
  daemon.process().stop();
  receiver.send(RawClient::message(MessageKind::kOpenInput, "/in"),
                {inbox.get(), bell.write_end().get()});
  fast.send(RawClient::message(MessageKind::kOpenOutput, "/fast"), {segment.get(), -1});
  daemon.process().signal(SIGCONT);
  const auto fast_port = fast.expect(MessageKind::kOpened).message.port;
  EXPECT_EQ(receiver.expect(MessageKind::kOutputGrown).message.peer, fast_port);
  answer_sync(slow, slow.expect(MessageKind::kSync).message);
  EXPECT_EQ(receiver.expect(MessageKind::kOutputGrown).message.peer, slow_port);
}

// What came after the last output port that it was shown: how often it was asked to take it up, and
// to look at how much of that port's memory is used.
struct AfterLastPeer {
  int syncs = 0;
  int grown = 0;
};
AfterLastPeer after_last_peer(RawClient& receiver) {
  receiver.send(RawClient::message(MessageKind::kStatus));
  AfterLastPeer after;
  for (wire::Received received; receiver.receive(received);) {
    if (received.message.kind == MessageKind::kOutputPeer) after = {};
    if (received.message.kind == MessageKind::kSync) ++after.syncs;
    if (received.message.kind == MessageKind::kOutputGrown) ++after.grown;
    if (received.message.kind == MessageKind::kStatusReply) break;
  }
  return after;
}

// Or samples would wait in a queue that the receiver does not know yet.
TEST(Introductions, OfAPortThatComesBackWhileItIsOpenedAreWaitedFor) {
  Daemon daemon(single_model());
  const auto segment = raw_output_segment();
  const auto inbox = raw_input_segment();
  const shm::Bell bell;
  RawClient receiver(daemon.instance());
  receiver.hello("receiver", wire::kHasServiceThread);
  receiver.send(RawClient::message(MessageKind::kOpenInput, "/in"),
                {inbox.get(), bell.write_end().get()});
  receiver.expect(MessageKind::kConnected);
  RawClient sender(daemon.instance());
  const auto welcome = sender.hello("sender", wire::kHasServiceThread | wire::kComesBack);
  sender.send(RawClient::message(MessageKind::kOpenOutput, "/out"), {segment.get(), -1});
  const auto opened = sender.expect(MessageKind::kOpened);
  answer_sync(receiver, receiver.expect(MessageKind::kSync).message);
  sender = RawClient(daemon.instance());
  auto hello = RawClient::hello_message(
      "sender", wire::kHasServiceThread | wire::kComesBack | wire::kRejoins);
  hello.link = welcome.message.link;
  sender.send(hello, {welcome.descriptors[0].get(), welcome.descriptors[1].get()});
  auto output = RawClient::message(MessageKind::kHandBackOutput, "/out");
  output.port = opened.message.port;
  output.id = opened.message.id;
  sender.send(output, {segment.get(), opened.descriptors[0].get()});
  sender.send(RawClient::message(MessageKind::kHandedBack));
  sender.expect(MessageKind::kInputPeer);
  RawClient other(daemon.instance());  // whose opening has segments shown that are new
  other.hello("other");
  open_in_step(other, "/other", segment);
  auto connect = RawClient::message(MessageKind::kConnect);
  connect.port = opened.message.port;
  sender.send(connect);
  sender.expect(MessageKind::kConnected);
  const AfterLastPeer after = after_last_peer(receiver);
  EXPECT_EQ(after.syncs, 3) << "for the other's, and for its own, once it has made room";
  EXPECT_EQ(after.grown, 2) << "by the other's opening, and once its own publisher has made room";
}

TEST(Introductions, SayInTheLogOnceForWhomTheyDoNotWait) {
  Daemon daemon(single_model());
  const auto segment = raw_output_segment();
  const auto inbox = raw_input_segment();
  const shm::Bell bell;
  RawClient receiver(daemon.instance());
  receiver.hello("late", wire::kHasServiceThread);
  receiver.send(RawClient::message(MessageKind::kOpenInput, "/in"),
                {inbox.get(), bell.write_end().get()});
  receiver.expect(MessageKind::kConnected);
  for (int times = 0; times < 2; ++times) {
    RawClient sender(daemon.instance());
    sender.hello();
    open_in_step(sender, "/out", segment);
  }
  daemon.terminate();
  const std::string log = daemon.log();
  const std::string late = " has not answered for 0.2 s, and is not waited for: ";
  const auto told = log.find(late);
  ASSERT_NE(told, std::string::npos) << log;
  EXPECT_NE(log.rfind("node \"late\" (pid ", told), std::string::npos) << log;
  EXPECT_EQ(log.find(late, told + 1), std::string::npos) << log;
}

// They are asked a second time once all have answered, or the time is over.
TEST(Introductions, AccuseNobodyWhoWasAskedWhenTheTimeWasOver) {
  Daemon daemon(
      "<behaviors><arbiter at='/in'><select from='/out'/></arbiter>"
      "<arbiter at='/well'><select from='/out'/></arbiter></behaviors>");
  const auto segment = raw_output_segment();
  const auto inbox = raw_input_segment();
  const auto other_inbox = raw_input_segment();
  const shm::Bell bell;
  RawClient late(daemon.instance());
  late.hello("late", wire::kHasServiceThread);
  late.send(RawClient::message(MessageKind::kOpenInput, "/in"),
            {inbox.get(), bell.write_end().get()});
  late.expect(MessageKind::kConnected);
  RawClient well(daemon.instance());
  well.hello("well", wire::kHasServiceThread);
  well.send(RawClient::message(MessageKind::kOpenInput, "/well"),
            {other_inbox.get(), bell.write_end().get()});
  well.expect(MessageKind::kConnected);
  RawClient sender(daemon.instance());
  sender.hello();
  sender.send(RawClient::message(MessageKind::kOpenOutput, "/out"), {segment.get(), -1});
  answer_sync(well, well.expect(MessageKind::kSync).message);
  sender.expect(MessageKind::kConnected);
  daemon.terminate();
  const std::string log = daemon.log();
  const auto told = log.find(" has not answered for 0.2 s");
  ASSERT_NE(told, std::string::npos) << log;
  EXPECT_NE(log.rfind("node \"late\" (pid ", told), std::string::npos) << log;
  EXPECT_EQ(log.find(" has not answered ", told + 1), std::string::npos) << log;
}

}  // namespace
}  // namespace arbiter::test
