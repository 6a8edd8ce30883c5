// What a client is sent that does not read, and that is kept back.
#include "service/clients/in_flight.hpp"

#include <gtest/gtest.h>
#include <sys/socket.h>
#include <unistd.h>

#include <optional>
#include <stdexcept>

#include "service/clients/client.hpp"
#include "shm/segment.hpp"
#include "wire/messages.hpp"

namespace arbiter::service {
namespace {

class ADeafClient : public testing::Test {
 protected:
  ADeafClient() {
    int ends[2];
    if (::socketpair(AF_UNIX, SOCK_SEQPACKET | SOCK_CLOEXEC | SOCK_NONBLOCK, 0, ends) != 0) {
      throw std::runtime_error("no sockets");
    }
    far_end_.reset(ends[0]);
    client_.emplace(1, shm::FileDescriptor(ends[1]), shares_);
    while (!client_->is_held_back() && sent_ < 1000) send(true);
  }

  void send(bool with_descriptors) {
    wire::Message message;
    message.request = ++sent_;
    const int segment = with_descriptors ? segment_.get() : -1;
    client_->send(message, {segment, segment});
  }
  // How many there are to be read, all in the order in which they were sent.
  std::uint64_t read_all() {
    std::uint64_t count = 0;
    wire::Received received;
    while (wire::receive_message(far_end_.get(), received, false) ==
           wire::ReceiveResult::kReceived) {
      EXPECT_EQ(received.message.request, ++read_);
      ++count;
    }
    return count;
  }

  Shares shares_{of_each(), 50, ::geteuid()};
  shm::FileDescriptor segment_ = shm::make_segment("test", 1);
  shm::FileDescriptor far_end_;
  std::optional<Client> client_;
  std::uint64_t sent_ = 0;
  std::uint64_t read_ = 0;

 private:
  static Totals of_each() {
    Totals totals{};
    totals.fill(1 << 20);
    return totals;
  }
};

TEST_F(ADeafClient, IsSentEverythingInOrderOnceItReads) {
  send(false);  // could be sent at once, and has to wait for the one before it
  send(true);
  while (client_->has_queue()) {
    EXPECT_GT(read_all(), 0u);
    client_->flush();
  }
  read_all();
  EXPECT_EQ(read_, sent_);
}

TEST_F(ADeafClient, IsLookedAtLessAndLessUntilItReads) {
  EXPECT_EQ(client_->flushed_in_vain(), 0u);
  client_->flush();
  client_->flush();
  EXPECT_EQ(client_->flushed_in_vain(), 2u);
  EXPECT_TRUE(client_->is_held_back());
  read_all();
  client_->flush();
  EXPECT_FALSE(client_->is_held_back());
  while (!client_->is_held_back() && sent_ < 1000) send(true);
  EXPECT_EQ(client_->flushed_in_vain(), 0u);
}

TEST_F(ADeafClient, ThatIsGivenUpCountsUntilItHasReadOrIsGone) {
  const uid_t user = client_->user();
  LeftUnread left;
  left.add(client_->release_unread());
  client_.reset();
  EXPECT_GT(shares_.taken(user, Share::kInFlight), 0u);
  left.look();
  EXPECT_FALSE(left.empty());
  read_all();
  left.look();
  EXPECT_TRUE(left.empty());
  EXPECT_EQ(shares_.taken(user, Share::kInFlight), 0u);
  EXPECT_EQ(shares_.taken(user, Share::kDescriptors), 0u);
}

}  // namespace
}  // namespace arbiter::service
