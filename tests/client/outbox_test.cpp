// What a node says to a daemon that does not read: it holds up nobody, and nothing of it is lost.
#include "client/node/outbox.hpp"

#include <fcntl.h>
#include <gtest/gtest.h>
#include <sys/resource.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include <arbiter/arbiter.hpp>

#include "shm/segment.hpp"
#include "tests/client/models.hpp"
#include "tests/client/samples.hpp"
#include "tests/support/daemon.hpp"

namespace arbiter::test {
namespace {

using detail::Outbox;

class OutboxOfASocket : public testing::Test {
 protected:
  OutboxOfASocket() {
    int ends[2] = {-1, -1};
    if (::socketpair(AF_UNIX, SOCK_SEQPACKET | SOCK_CLOEXEC, 0, ends) != 0)
      throw Error("socketpair");
    node_.reset(ends[0]);
    daemon_.reset(ends[1]);
    detail::make_non_blocking(node_);
  }

  static wire::Message numbered(std::uint64_t number) {
    wire::Message message;
    message.request = number;
    message.set_text("so that it takes up room");
    return message;
  }
  // What has come by now; the number of the message is that of its place.
  void hear_all() {
    wire::Received received;
    while (wire::receive_message(daemon_.get(), received, false) ==
           wire::ReceiveResult::kReceived) {
      EXPECT_EQ(received.message.request, ++heard_);
      has_descriptor_.push_back(static_cast<bool>(received.descriptors[0]));
    }
  }

  shm::FileDescriptor node_;
  shm::FileDescriptor daemon_;
  Outbox outbox_;
  std::uint64_t heard_ = 0;
  std::vector<bool> has_descriptor_;
};

TEST_F(OutboxOfASocket, KeepsWhatThereIsNoRoomForInItsOrder) {
  std::uint64_t said = 0;
  while (outbox_.empty()) ASSERT_TRUE(outbox_.send(node_.get(), numbered(++said)));
  {
    const shm::FileDescriptor own = shm::make_segment("test", 4096);
    ASSERT_TRUE(outbox_.send(node_.get(), numbered(++said), {own.get(), -1}));
  }
  outbox_.flush(node_.get());
  EXPECT_FALSE(outbox_.empty()) << "there is no room yet";
  hear_all();
  ASSERT_TRUE(outbox_.send(node_.get(), numbered(++said))) << "behind what waits";
  outbox_.flush(node_.get());
  EXPECT_TRUE(outbox_.empty());
  hear_all();
  EXPECT_EQ(heard_, said);
  ASSERT_EQ(has_descriptor_.size(), said);
  EXPECT_TRUE(has_descriptor_[said - 2]) << "a copy, for the sender's has been closed";
  EXPECT_EQ(std::count(has_descriptor_.begin(), has_descriptor_.end(), true), 1);
}

TEST_F(OutboxOfASocket, EndsTheConversationWhereTooMuchWaits) {
  std::uint64_t said = 0;
  while (outbox_.send(node_.get(), numbered(++said))) ASSERT_LT(said, 100'000u);
  EXPECT_GT(said, 4096u);
}

// With its descriptors: who asks again and again would have none left.
TEST_F(OutboxOfASocket, WithdrawsWhatNobodyWaitsFor) {
  std::uint64_t said = 0;
  while (outbox_.empty()) ASSERT_TRUE(outbox_.send(node_.get(), numbered(++said)));
  EXPECT_FALSE(outbox_.withdraw(1)) << "it is in the socket";
  int ends[2] = {-1, -1};
  ASSERT_EQ(::pipe2(ends, O_CLOEXEC), 0);
  const shm::FileDescriptor reads(ends[0]);
  shm::FileDescriptor writes(ends[1]);
  ASSERT_TRUE(outbox_.send(node_.get(), numbered(said + 1), {writes.get(), -1}));
  writes.reset();
  EXPECT_TRUE(outbox_.withdraw(said + 1));
  char nothing = 0;
  EXPECT_EQ(::read(reads.get(), &nothing, 1), 0) << "no copy of it is left";
  hear_all();
  outbox_.flush(node_.get());
  hear_all();
  EXPECT_EQ(heard_, said);
}

TEST_F(OutboxOfASocket, ForgetsWhatNobodyWillRead) {
  for (std::uint64_t said = 0; outbox_.empty();) {
    ASSERT_TRUE(outbox_.send(node_.get(), numbered(++said)));
  }
  daemon_.reset();
  outbox_.flush(node_.get());
  EXPECT_TRUE(outbox_.empty());
}

constexpr int kManyPorts = 300;  // to close them is more than a socket has room for

void raise_descriptor_limit() {
  rlimit limit{};
  ASSERT_EQ(::getrlimit(RLIMIT_NOFILE, &limit), 0);
  limit.rlim_cur = std::min<rlim_t>(limit.rlim_max, 16 * kManyPorts);
  ASSERT_EQ(::setrlimit(RLIMIT_NOFILE, &limit), 0);
}

std::string name_of_port(int port) { return "/" + std::to_string(port); }

// That no model mentions them.
NodeOptions silent_options() {
  NodeOptions options;
  options.on_notice = [](const Notice&) {};
  return options;
}

TEST(Outbox, OfANodeThatClosesItsPortsHasTheDaemonHearOfEach) {
  raise_descriptor_limit();
  Daemon daemon(single_model());
  Node node("test", silent_options());
  std::vector<OutputPort<void>> ports;
  for (int i = 0; i < kManyPorts; ++i) ports.push_back(node.output_port(name_of_port(i)));
  daemon.process().stop();
  ports.clear();
  daemon.process().resume();
  for (int i = 0; i < kManyPorts; ++i) ports.push_back(node.output_port(name_of_port(i)));
}

// Whatever waits of it when it ends.
TEST(Outbox, OfANodeThatEndsLeavesNoPortOpen) {
  raise_descriptor_limit();
  Daemon daemon(single_model());
  std::optional<Node> node(std::in_place, "test", silent_options());
  std::vector<OutputPort<void>> ports;
  for (int i = 0; i < kManyPorts; ++i) ports.push_back(node->output_port(name_of_port(i)));
  daemon.process().stop();
  ports.clear();
  daemon.process().resume();
  node.emplace("next", silent_options());
  for (int i = 0; i < kManyPorts; ++i) ports.push_back(node->output_port(name_of_port(i)));
}

}  // namespace
}  // namespace arbiter::test
