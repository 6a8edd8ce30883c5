// What a client can do to the daemon by descriptors that it sends along and that take for ever to
// close.
#include <gtest/gtest.h>
#include <sys/resource.h>
#include <sys/socket.h>
#include <sys/stat.h>

#include <deque>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include <arbiter/arbiter.hpp>

#include "tests/attack/attacker.hpp"
#include "tests/support/await.hpp"
#include "tests/support/daemon.hpp"
#include "tests/support/lingering.hpp"
#include "tests/support/other_user.hpp"
#include "tests/support/raw_port.hpp"
#include "wire/errands.hpp"

namespace arbiter::test {
namespace {

using shm::FileDescriptor;
using wire::MessageKind;

bool try_to_send_with(int socket, const wire::Message& message,
                      const std::vector<int>& descriptors) {
  return test::try_to_send_with(socket, std::as_bytes(std::span(&message, 1)), descriptors);
}

void send_with(int socket, const wire::Message& message, const std::vector<int>& descriptors) {
  ASSERT_TRUE(try_to_send_with(socket, message, descriptors));
}

void expect_that_others_are_served(Daemon& daemon) {
  Node node("honest");
  auto out = node.output_port<int>("/honest:o");
  auto in = node.input_port<int>("/honest:i");
  EXPECT_FALSE(daemon.source("/honest:o").is_null());
}

void wait_until_a_thread_is_lost(Daemon& daemon) {
  await([&] {
    daemon.status();  // and it answers
    return daemon.log().find("keeps a thread waiting") != std::string::npos;
  });
}

class ALingeringSocket : public testing::Test {
 protected:
  explicit ALingeringSocket(Daemon::Options options = {}) : daemon_(kNoRules, std::move(options)) {}

  RawClient client() {
    RawClient result(daemon_.instance());
    result.hello("attacker");
    return result;
  }
  // Sends it in such a way that the daemon is the last to close it.
  template <class Send>
  void give(Lingering& lingering, Send send) {
    daemon_.process().stop();
    send(lingering.get());
    lingering.close();
    daemon_.process().signal(SIGCONT);
  }
  void await_last_thread() {
    await([&] {
      daemon_.status();
      return daemon_.log().find("4 of 4") != std::string::npos;
    });
  }
  void expect_no_harm() {
    expect_that_others_are_served(daemon_);
    wait_until_a_thread_is_lost(daemon_);
    expect_that_others_are_served(daemon_);
    EXPECT_EQ(daemon_.terminate(), 0) << "it does not wait for what is lost";
  }

  Daemon daemon_;
};

TEST_F(ALingeringSocket, AsAWantedDescriptorHoldsUpNobody) {
  Lingering lingering;
  RawClient attacker = client();
  give(lingering, [&](int fd) {
    attacker.send(RawClient::message(MessageKind::kOpenOutput, "/attacker:o"), {fd, -1});
  });
  EXPECT_NE(attacker.expect_refusal().find("neither a memfd nor an anonymous pipe"),
            std::string::npos);
  expect_no_harm();
}

TEST_F(ALingeringSocket, AsOneTooManyHoldsUpNobody) {
  Lingering lingering;
  RawClient attacker = client();
  const FileDescriptor zero(::open("/dev/zero", O_RDONLY | O_CLOEXEC));
  give(lingering, [&](int fd) {
    std::vector<int> many(wire::kMostDescriptorsOfAMessage, zero.get());
    many.back() = fd;
    send_with(attacker.socket(), RawClient::message(MessageKind::kStatus), many);
  });
  expect_no_harm();
}

// Who opens a name that somebody has open makes the daemon read ahead what that client has sent: it
// may have closed the port. What comes so in a message that is none is not closed by the loop
// either.
TEST_F(ALingeringSocket, AsOneTooManyInAMessageThatIsReadAheadHoldsUpNobody) {
  Lingering lingering;
  const FileDescriptor segment = raw_output_segment();
  RawClient holder = client();
  open_raw_output(holder, "/attacker:o", segment);
  RawClient other = client();
  give(lingering, [&](int fd) {
    // Heard first, so served first.
    other.send(RawClient::message(MessageKind::kOpenOutput, "/attacker:o"), {segment.get(), -1});
    send_with(holder.socket(), RawClient::message(MessageKind::kStatus),
              {segment.get(), segment.get(), fd});
  });
  expect_no_harm();
}

TEST_F(ALingeringSocket, InAMessageThatIsNeverReadHoldsUpNobody) {
  Lingering lingering;
  {
    RawClient attacker = client();
    give(lingering, [&](int fd) {
      attacker.send_bytes("?", 1);  // the daemon hangs up on that
      send_with(attacker.socket(), RawClient::message(MessageKind::kStatus), {fd});
    });
    EXPECT_TRUE(attacker.is_hung_up_on());
  }
  expect_no_harm();
}

TEST_F(ALingeringSocket, InsideASocketHoldsUpNobody) {
  Lingering lingering;
  RawClient attacker = client();
  int ends[2];
  ASSERT_EQ(::socketpair(AF_UNIX, SOCK_SEQPACKET | SOCK_CLOEXEC, 0, ends), 0);
  FileDescriptor inner(ends[0]);
  const FileDescriptor outer(ends[1]);
  give(lingering, [&](int fd) {
    send_with(outer.get(), RawClient::message(MessageKind::kStatus), {fd});
    send_with(attacker.socket(), RawClient::message(MessageKind::kStatus), {inner.get()});
    inner.reset();
  });
  expect_no_harm();
}

// More than there are threads for one user: the rest waits, and another user's is done.
TEST_F(ALingeringSocket, SentManyTimesHoldsUpNobody) {
  std::vector<Lingering> many(6);
  RawClient attacker = client();
  daemon_.process().stop();
  for (Lingering& each : many) {
    send_with(attacker.socket(), RawClient::message(MessageKind::kStatus), {each.get()});
    each.close();
  }
  daemon_.process().signal(SIGCONT);
  expect_that_others_are_served(daemon_);
  await_last_thread();
  expect_that_others_are_served(daemon_);
}

// Once all threads of a user are lost, what comes after waits, and keeps its descriptors: it must
// not use up those of others.
class AUserWhoseThreadsAreLost : public ALingeringSocket {
 protected:
  // A thread, and all that may wait for one, and a message that is read before that is seen.
  static constexpr std::size_t kMostKept = wire::Errands::kMaxLostOfAUser +
                                           wire::Errands::kMaxWaiting +
                                           2 * wire::kMostDescriptorsOfAMessage;

  explicit AUserWhoseThreadsAreLost(Daemon::Options options = {})
      : ALingeringSocket(std::move(options)) {
    RawClient attacker = client();
    daemon_.process().stop();
    for (Lingering& each : lingering_) {
      send_with(attacker.socket(), RawClient::message(MessageKind::kStatus), {each.get()});
      each.close();
    }
    daemon_.process().signal(SIGCONT);
    await_last_thread();
  }

  std::vector<Lingering> lingering_{wire::Errands::kMaxLostOfAUser};
};

TEST_F(AUserWhoseThreadsAreLost, CostsNothingByConnectingAgainAndAgain) {
  const std::size_t before = daemon_.open_descriptors();
  for (int i = 0; i < 2000; ++i) {
    RawClient again(daemon_.instance());
    again.send(RawClient::message(MessageKind::kStatus));
  }
  expect_that_others_are_served(daemon_);
  EXPECT_LT(daemon_.open_descriptors(), before + 100);
}

TEST_F(AUserWhoseThreadsAreLost, IsGivenUpBeforeItKeepsThoseOfOthers) {
  const std::size_t before = daemon_.open_descriptors();
  const FileDescriptor zero(::open("/dev/zero", O_RDONLY | O_CLOEXEC));
  const std::vector<int> many(wire::kMostDescriptorsOfAMessage, zero.get());
  for (int i = 0; i < 20; ++i) {
    RawClient again(daemon_.instance());
    try_to_send_with(again.socket(), RawClient::message(MessageKind::kStatus), many);
    again.is_hung_up_on();
  }
  EXPECT_LT(daemon_.open_descriptors(), before + kMostKept);
  for (Lingering& each : lingering_) each.release();
  await([&] { return daemon_.open_descriptors() <= before; });
  expect_that_others_are_served(daemon_);
}

// Who has all that he may have is turned away before anything is read from him.
class AUserWithoutThreadsOrShare : public AUserWhoseThreadsAreLost {
 protected:
  AUserWithoutThreadsOrShare()
      : AUserWhoseThreadsAreLost({.arguments = {"--user-share", "10"}, .max_descriptors = 3000}) {}

  void SetUp() override {
    if (!may_be_another_user()) GTEST_SKIP() << "only root can start processes of other users";
    ASSERT_EQ(::chmod(daemon_.directory().c_str(), 0711), 0);
    try {
      for (;;) clients_.emplace_back(daemon_.instance()).hello();
    } catch (const std::runtime_error&) {  // has been turned away
    }
    clients_.pop_back();
    const FileDescriptor zero(::open("/dev/zero", O_RDONLY | O_CLOEXEC));
    for (std::size_t waiting = 0; waiting < wire::Errands::kMaxWaiting; waiting += 2) {
      send_with(clients_.back().socket(), RawClient::message(MessageKind::kConnect),
                {zero.get(), zero.get()});
      clients_.back().expect_refusal();
    }
  }

  std::deque<RawClient> clients_;
};

TEST_F(AUserWithoutThreadsOrShare, CostsNothingByConnectingAgainAndAgain) {
  const std::size_t before = daemon_.open_descriptors();
  for (int i = 0; i < 2000; ++i) RawClient again(daemon_.instance());
  // Who comes later is let in later.
  EXPECT_EQ(as_user(kStranger,
                    [] {
                      Node node("honest");
                      auto out = node.output_port<int>("/honest:o");
                      return std::string("opened");
                    }),
            "opened");
  EXPECT_LT(daemon_.open_descriptors(), before + 30);
}

}  // namespace
}  // namespace arbiter::test
