// Waiting until clients have taken up what they were told: for a bounded time, and for nobody who
// is gone.
#include "service/clients/barriers.hpp"

#include <gtest/gtest.h>
#include <sys/socket.h>
#include <unistd.h>

#include <array>

namespace arbiter::service {
namespace {

class BarriersTest : public testing::Test {
 protected:
  BarriersTest() : one_(make(1)), two_(make(2)) {}

  std::unique_ptr<Client> make(ClientId id) {
    std::array<int, 2> ends{};
    EXPECT_EQ(socketpair(AF_UNIX, SOCK_SEQPACKET | SOCK_NONBLOCK | SOCK_CLOEXEC, 0, ends.data()),
              0);
    others_.emplace_back(ends[1]);
    auto client = std::make_unique<Client>(id, shm::FileDescriptor(ends[0]), shares_);
    client->has_service_thread = true;
    return client;
  }
  // The number of the barrier that a client has been asked about.
  std::uint64_t asked(std::size_t client) {
    wire::Received received;
    const auto result = wire::receive_message(others_[client].get(), received, false);
    if (result != wire::ReceiveResult::kReceived) return 0;
    EXPECT_EQ(received.message.kind, wire::MessageKind::kSync);
    return received.message.request;
  }
  void raise(const std::set<Client*>& clients, shm::Nanoseconds deadline = 100) {
    barriers_.raise(clients, deadline, [this] { ++passed_; });
  }

  Shares shares_{totals_of_this_process(), Shares::kDefaultPercent, geteuid()};
  std::vector<shm::FileDescriptor> others_;
  std::unique_ptr<Client> one_;
  std::unique_ptr<Client> two_;
  Barriers barriers_;
  int passed_ = 0;
};

TEST_F(BarriersTest, ForNobodyPassesAtOnce) {
  raise({});
  EXPECT_EQ(passed_, 1);
  EXPECT_EQ(barriers_.next_deadline(), shm::kForever);
}

TEST_F(BarriersTest, PassesWhenAllHaveAnswered) {
  raise({one_.get(), two_.get()});
  EXPECT_EQ(passed_, 0);
  EXPECT_EQ(barriers_.next_deadline(), 100);
  barriers_.synced(1, asked(0));
  EXPECT_EQ(passed_, 0);
  barriers_.synced(2, asked(1));
  EXPECT_EQ(passed_, 1);
}

TEST_F(BarriersTest, PassesOnceThoughAClientAnswersTwice) {
  raise({one_.get()});
  const auto number = asked(0);
  for (int i = 0; i < 3; ++i) barriers_.synced(1, number);
  EXPECT_EQ(passed_, 1);
}

TEST_F(BarriersTest, AnAnswerToAnotherOneDoesNotCount) {
  raise({one_.get()});
  barriers_.synced(1, asked(0) + 1);
  barriers_.synced(2, 1);
  EXPECT_EQ(passed_, 0);
}

TEST_F(BarriersTest, IsGivenUpAtItsDeadline) {
  raise({one_.get()});
  barriers_.expire(99);
  EXPECT_EQ(passed_, 0);
  barriers_.expire(100);
  EXPECT_EQ(passed_, 1);
}

TEST_F(BarriersTest, WaitsForNobodyWhoHasLeft) {
  raise({one_.get(), two_.get()});
  barriers_.forget(1);
  EXPECT_EQ(passed_, 0);
  barriers_.forget(2);
  EXPECT_EQ(passed_, 1);
}

TEST_F(BarriersTest, WaitsForNobodyWithoutAServiceThread) {
  one_->has_service_thread = false;
  raise({one_.get()});
  EXPECT_EQ(passed_, 1);
  EXPECT_EQ(asked(0), 0u);
}

TEST_F(BarriersTest, OneMayBeRaisedWhileAnotherPasses) {
  barriers_.raise({one_.get()}, 100, [this] { raise({two_.get()}); });
  barriers_.synced(1, asked(0));
  EXPECT_EQ(passed_, 0);
  barriers_.synced(2, asked(1));
  EXPECT_EQ(passed_, 1);
}

}  // namespace
}  // namespace arbiter::service
