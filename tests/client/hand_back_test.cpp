// What a node hands back to the next daemon, before one that is slow to read it, or goes again.
#include <fcntl.h>
#include <gtest/gtest.h>
#include <poll.h>
#include <sys/resource.h>
#include <sys/socket.h>

#include <algorithm>
#include <map>
#include <string>
#include <utility>
#include <vector>

#include <arbiter/arbiter.hpp>

#include "shm/clock.hpp"
#include "shm/segment.hpp"
#include "tests/client/models.hpp"
#include "tests/support/await.hpp"
#include "tests/support/daemon.hpp"
#include "tests/support/descriptor_limit.hpp"
#include "wire/messages.hpp"
#include "wire/rendezvous.hpp"

namespace arbiter::test {
namespace {

using wire::MessageKind;

constexpr int kPortsToHandBack = 300;  // more than a socket has room for

std::string port_of(int number) { return "/port" + std::to_string(number); }

// In the place of one that was killed; it says and reads what the test likes.
class NextDaemon {
 public:
  explicit NextDaemon(const Daemon& last)
      : listener_(wire::listen_at(last.directory() + "/arbiter", last.instance())) {}

  // Waits for a node that services itself.
  void let_in(Node& node) {
    pollfd comes{listener_.socket.get(), POLLIN, 0};
    while (::poll(&comes, 1, 1) == 0) node.service();
    socket_.reset(::accept4(listener_.socket.get(), nullptr, nullptr, SOCK_CLOEXEC));
  }
  wire::ReceiveResult receive(wire::Received& received) {
    return wire::receive_message(socket_.get(), received, false);
  }
  wire::SendResult send(const wire::Message& message, int descriptor = -1, int second = -1) {
    fcntl(socket_.get(), F_SETFL, O_NONBLOCK);
    return wire::send_message(socket_.get(), message, {descriptor, second});
  }
  void hang_up() { socket_.reset(); }

  // All that the node says until a message of that kind, which is the last.
  std::vector<wire::Message> hear_until(Node& node, MessageKind last) {
    std::vector<wire::Message> heard;
    while (heard.empty() || heard.back().kind != last) {
      node.service();
      wire::Received received;
      const auto result = receive(received);
      if (result == wire::ReceiveResult::kReceived) {
        heard.push_back(received.message);
        if (received.message.kind == MessageKind::kHello) hello_ = std::move(received);
      } else if (result != wire::ReceiveResult::kNothing) {
        ADD_FAILURE() << "the node has given up after " << heard.size() << " messages";
        return heard;
      }
    }
    return heard;
  }
  // As the daemon whose memory the hello has brought.
  void welcome() {
    wire::Message welcome;
    welcome.kind = MessageKind::kWelcome;
    welcome.link = hello_.message.link;
    welcome.peer = static_cast<std::uint64_t>(shm::monotonic_now());
    EXPECT_EQ(send(welcome, hello_.descriptors[0].get(), hello_.descriptors[1].get()),
              wire::SendResult::kSent);
  }

 private:
  const wire::Listener listener_;
  shm::FileDescriptor socket_;
  wire::Received hello_;
};

int count_kind(const std::vector<wire::Message>& heard, MessageKind kind) {
  return static_cast<int>(std::count_if(heard.begin(), heard.end(),
                                        [&](const auto& each) { return each.kind == kind; }));
}

class HandBack : public testing::Test {
 protected:
  static NodeOptions self_served() {
    NodeOptions options;
    options.service_thread = false;
    options.on_notice = [](const Notice&) {};
    return options;
  }
  static rlim_t enough() {
    rlimit limit{};
    ::getrlimit(RLIMIT_NOFILE, &limit);
    return std::min<rlim_t>(limit.rlim_max, 20 * kPortsToHandBack);
  }
  void open_ports(int count) {
    for (int i = 0; i < count; ++i) ports_.push_back(node_.output_port(port_of(i)));
  }
  // From now on; it is above all that are open.
  static rlim_t next_descriptor() {
    std::vector<shm::FileDescriptor> taken;
    const int first = ::fcntl(STDERR_FILENO, F_DUPFD_CLOEXEC, 0);
    int most = first;
    taken.emplace_back(first);
    for (int i = 0; i < 64; ++i) {
      taken.emplace_back(::fcntl(STDERR_FILENO, F_DUPFD_CLOEXEC, most));
      most = taken.back().get();
    }
    return static_cast<rlim_t>(most);
  }

  const DescriptorLimit limit_{enough()};
  Daemon daemon_{single_model()};
  Node node_{"test", self_served()};
  std::vector<OutputPort<void>> ports_;
};

TEST_F(HandBack, WaitsForNobodyAndLosesNothing) {
  open_ports(kPortsToHandBack);
  daemon_.kill();
  NextDaemon next(daemon_);
  next.let_in(node_);
  const auto heard = next.hear_until(node_, MessageKind::kHandedBack);
  ASSERT_FALSE(heard.empty());
  EXPECT_EQ(heard.front().kind, MessageKind::kHello);
  EXPECT_EQ(count_kind(heard, MessageKind::kHandBackOutput), kPortsToHandBack);
}

// None is copied for what waits until there is room for it.
TEST_F(HandBack, NeedsNoDescriptorsOfItsOwn) {
  open_ports(kPortsToHandBack);
  daemon_.kill();
  NextDaemon next(daemon_);
  const auto few = next_descriptor();
  std::vector<wire::Message> heard;
  {
    const DescriptorLimit limit(few);
    next.let_in(node_);
    heard = next.hear_until(node_, MessageKind::kHandedBack);
  }
  EXPECT_EQ(count_kind(heard, MessageKind::kHandBackOutput), kPortsToHandBack);
}

TEST_F(HandBack, BeginsAnewWhereTheDaemonGoesInTheMiddle) {
  open_ports(kPortsToHandBack);
  daemon_.kill();
  NextDaemon next(daemon_);
  next.let_in(node_);
  static_cast<void>(next.hear_until(node_, MessageKind::kHandBackOutput));
  next.hang_up();
  next.let_in(node_);
  const auto heard = next.hear_until(node_, MessageKind::kHandedBack);
  ASSERT_FALSE(heard.empty());
  EXPECT_EQ(heard.front().kind, MessageKind::kHello);
  EXPECT_EQ(count_kind(heard, MessageKind::kHandBackOutput), kPortsToHandBack);
}

TEST_F(HandBack, SaysNothingOfAPortThatHasClosedBeforeItsTurnAndEndsOneThatHadIts) {
  open_ports(kPortsToHandBack);
  daemon_.kill();
  NextDaemon next(daemon_);
  next.let_in(node_);
  const auto begun = next.hear_until(node_, MessageKind::kHandBackOutput);
  ASSERT_FALSE(begun.empty());
  ports_.clear();
  const auto rest = next.hear_until(node_, MessageKind::kHandedBack);
  const int said = 1 + count_kind(rest, MessageKind::kHandBackOutput);
  EXPECT_LT(said, kPortsToHandBack);
  EXPECT_EQ(count_kind(rest, MessageKind::kClosePort), 0) << "before what it follows";
  next.welcome();
  std::map<shm::PortInstance, int> closed;
  while (closed.size() < static_cast<std::size_t>(kPortsToHandBack)) {
    const auto close = next.hear_until(node_, MessageKind::kClosePort);
    if (HasFailure()) return;
    ++closed[close.back().port];
  }
  EXPECT_EQ(closed.count(begun.back().port), 1u);
}

// Each link behind its port, and nothing that the daemon has said heard before the end.
TEST_F(HandBack, KeepsTheOrderThatTheDaemonExpects) {
  open_ports(2);
  auto out = node_.output_port<int>("/out");
  auto in = node_.input_port<int>("/in");
  daemon_.kill();
  NextDaemon next(daemon_);
  next.let_in(node_);
  const auto heard = next.hear_until(node_, MessageKind::kHandedBack);
  shm::PortInstance last = 0;
  for (const wire::Message& each : heard) {
    if (each.kind == MessageKind::kHandBackLink) {
      EXPECT_EQ(each.port, last);
    } else {
      last = each.port;
    }
  }
  EXPECT_EQ(count_kind(heard, MessageKind::kHandBackLink), 2);
  EXPECT_EQ(count_kind(heard, MessageKind::kHandBackOutput), 3);
  EXPECT_EQ(count_kind(heard, MessageKind::kHandBackInput), 1);
  EXPECT_EQ(heard.back().kind, MessageKind::kHandedBack);
}

// However many they are, and however few descriptors are left.
TEST_F(HandBack, AsksForEachTapAgain) {
  std::vector<Tap<void>> taps;
  for (int i = 0; i < kPortsToHandBack; ++i) taps.push_back(node_.tap("/out"));
  daemon_.kill();
  NextDaemon next(daemon_);
  const auto few = next_descriptor();
  std::vector<wire::Message> heard;
  const DescriptorLimit limit(few);
  next.let_in(node_);
  static_cast<void>(next.hear_until(node_, MessageKind::kHandedBack));
  next.welcome();
  for (int asked = 0; asked < kPortsToHandBack && !HasFailure(); ++asked) {
    const auto question = next.hear_until(node_, MessageKind::kOpenTap);
    EXPECT_EQ(question.size(), 1u);
  }
}

// A daemon that says more than it reads.
TEST_F(HandBack, OrNewsThatAreRefusedEndNoConversation) {
  auto in = node_.input_port<int>("/in");
  daemon_.kill();
  NextDaemon next(daemon_);
  next.let_in(node_);
  const auto heard = next.hear_until(node_, MessageKind::kHandedBack);
  const auto input = std::find_if(heard.begin(), heard.end(), [](const auto& each) {
    return each.kind == MessageKind::kHandBackInput;
  });
  ASSERT_NE(input, heard.end());
  next.welcome();
  const shm::FileDescriptor strange = shm::make_segment("test", 4096);
  wire::Message peer;
  peer.kind = MessageKind::kOutputPeer;
  peer.port = input->port;
  peer.set_name("/out");
  constexpr shm::PortInstance kPeers = 6000;
  constexpr shm::PortInstance kFirst = 1'000'000;
  shm::PortInstance said = 0, refused = 0;
  while (refused < kPeers && !HasFailure()) {
    for (int in_vain = 0; said < kPeers && in_vain < 3;) {
      peer.peer = kFirst + said;
      if (next.send(peer, strange.get()) == wire::SendResult::kSent) {
        ++said;
      } else {
        node_.service();
        ++in_vain;
      }
    }
    const auto answer = next.hear_until(node_, MessageKind::kPeerRefused);
    if (HasFailure()) return;
    EXPECT_EQ(answer.back().peer, kFirst + refused++);
  }
}

// It is tried again, and the conversation goes on meanwhile.
TEST_F(HandBack, IsNotNeededWhereAPageCannotBeMapped) {
  auto out = node_.output_port<int>("/out");
  auto in = node_.input_port<int>("/in");
  daemon_.kill();
  NextDaemon next(daemon_);
  next.let_in(node_);
  const auto heard = next.hear_until(node_, MessageKind::kHandedBack);
  next.welcome();
  node_.service();
  while (in.take()) {
  }
  pollfd ready{in.fd(), POLLIN, 0};
  const shm::FileDescriptor page = shm::make_segment("test", sizeof(shm::ActivityPage));
  wire::Message shown;
  shown.kind = MessageKind::kSourcePage;
  shown.id = 77;
  shown.value = 1;
  shown.set_name("/another");
  ASSERT_EQ(next.send(shown, page.get()), wire::SendResult::kSent);
  wire::Message sync;
  sync.kind = MessageKind::kSync;
  ASSERT_EQ(next.send(sync), wire::SendResult::kSent);
  static_cast<void>(next.hear_until(node_, MessageKind::kSynced));
  node_.service();
  wire::Received nothing;
  EXPECT_EQ(next.receive(nothing), wire::ReceiveResult::kNothing) << "it has hung up";
  while (in.take()) {
  }
  ASSERT_EQ(::poll(&ready, 1, 0), 0);
  shm::seal(page, shm::Seals::kFixedSize);  // now it can be
  while (::poll(&ready, 1, 1) == 0) node_.service();
}

TEST(HandedBack, PortsOfANodeWithFewDescriptorsAreOpenAtTheNextDaemon) {
  rlimit limit{};
  ASSERT_EQ(::getrlimit(RLIMIT_NOFILE, &limit), 0);
  const DescriptorLimit enough(std::min<rlim_t>(limit.rlim_max, 20 * kPortsToHandBack));
  Daemon daemon(single_model());
  NodeOptions options;
  options.on_notice = [](const Notice&) {};
  Node node("test", options);
  std::vector<OutputPort<void>> ports;
  for (int i = 0; i < kPortsToHandBack; ++i) ports.push_back(node.output_port(port_of(i)));
  const shm::FileDescriptor last(::fcntl(STDERR_FILENO, F_DUPFD_CLOEXEC, 0));
  const DescriptorLimit few(static_cast<rlim_t>(last.get()) + 16);
  daemon.kill();
  daemon.restart();
  const std::string is_back = "is back, with " + std::to_string(kPortsToHandBack) + " ports";
  await([&] { return daemon.log().find(is_back) != std::string::npos; });
}

}  // namespace
}  // namespace arbiter::test
