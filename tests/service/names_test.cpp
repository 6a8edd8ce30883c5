// Who has a port's name, where its component closes it or dies and the daemon hears of it late.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/syscall.h>
#include <sys/wait.h>

#include <arbiter/arbiter.hpp>

#include "tests/support/daemon.hpp"
#include "tests/support/raw_port.hpp"
#include "tests/support/threads.hpp"

namespace arbiter::test {
namespace {

using wire::MessageKind;

wire::Message open_untyped(const std::string& name) {
  return RawClient::message(MessageKind::kOpenOutput, name);
}

// The port's name is asked for twice by the same client, which is dead by the time that the second
// request is read.
TEST(Names, AskedForTwiceByAComponentThatIsDeadByThenAreFree) {
  Daemon daemon;
  const pid_t child = ::fork();
  if (child == 0) {
    RawClient client(daemon.instance());
    client.hello("doomed");
    ::kill(daemon.process().pid(), SIGSTOP);
    const auto segment = raw_output_segment();
    for (int i = 0; i < 2; ++i) client.send(open_untyped("/twice"), {segment.get(), -1});
    ::_exit(0);
  }
  int status = 0;
  ASSERT_EQ(::waitpid(child, &status, 0), child);
  ASSERT_EQ(status, 0);
  daemon.process().signal(SIGCONT);
  Node node("test");
  auto port = node.output_port<int>("/twice");
}

// The daemon reads the sockets in an order of its own. A name is free once its port has been
// closed, though the closing lies in a socket that is read later.
TEST(Names, AreFreeInTheOrderInWhichComponentsSpoke) {
  Daemon daemon;
  for (int round = 0; round < 5; ++round) {
    RawClient first(daemon.instance());
    RawClient second(daemon.instance());
    first.hello("first");
    second.hello("second");
    const auto segment = raw_output_segment();
    first.send(open_untyped("/x"), {segment.get(), -1});
    auto close = RawClient::message(MessageKind::kClosePort);
    close.port = first.expect(MessageKind::kOpened).message.port;
    first.expect(MessageKind::kConnected);
    wait_until_it_sleeps_in(SYS_epoll_wait, daemon.process().pid(), daemon.process().pid());
    daemon.process().stop();
    second.send(RawClient::message(MessageKind::kClosePort));  // now its socket comes first
    if (round % 2 == 0) {
      first.send(close);
    } else {
      first = RawClient(daemon.instance());  // hangs up
    }
    second.send(open_untyped("/x"), {segment.get(), -1});
    daemon.process().signal(SIGCONT);
    EXPECT_NO_THROW(second.expect(MessageKind::kOpened));
  }
}

// Its conversation ends, and it lives: it may come back for them.
TEST(Names, OfAComponentThatIsLostAreKeptThoughAnotherAsksAtOnce) {
  Daemon daemon;
  RawClient lost(daemon.instance());
  lost.hello("lost", wire::kComesBack);
  const auto segment = raw_output_segment();
  open_raw_output(lost, "/x", segment);
  RawClient asking(daemon.instance());
  asking.hello("asking");
  wait_until_it_sleeps_in(SYS_epoll_wait, daemon.process().pid(), daemon.process().pid());
  daemon.process().stop();
  asking.send(open_untyped("/x"), {segment.get(), -1});
  lost.hang_up();
  daemon.process().signal(SIGCONT);
  EXPECT_THROW(asking.expect(MessageKind::kOpened), std::runtime_error);
  EXPECT_TRUE(daemon.source("/x")["away"]);
}

// As a program finds that its process has executed: the process lives, and its ports are kept.
TEST(Names, OfAProgramBeforeInTheSameProcessAreKeptAndItIsTold) {
  Daemon daemon;
  const auto segment = raw_output_segment();
  {
    RawClient before(daemon.instance());
    before.hello("before", wire::kComesBack);
    open_raw_output(before, "/x", segment);
  }
  RawClient after(daemon.instance());
  after.hello("after");
  after.send(open_untyped("/x"), {segment.get(), -1});
  EXPECT_THAT(after.expect_refusal(), testing::HasSubstr("end the process and start anew"));
}

}  // namespace
}  // namespace arbiter::test
