// Datagrams that leave together: link/dds/datagram_train.hpp. What boards the train is sent as
// Cyclone sends, by ddsrt_sendmsg().
#include "link/dds/datagram_train.hpp"

#include <arpa/inet.h>
#include <dds/ddsrt/retcode.h>
#include <dds/ddsrt/sockets.h>
#include <gtest/gtest.h>
#include <netinet/in.h>
#include <sys/socket.h>

#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <random>
#include <vector>

#include "shm/file_descriptor.hpp"

namespace arbiter::link {
namespace {

using Datagram = std::vector<std::uint8_t>;

Datagram datagram(std::size_t bytes, std::size_t number) {
  Datagram result(bytes);
  for (std::size_t i = 0; i < bytes; ++i) result[i] = static_cast<std::uint8_t>(number + i / 7);
  return result;
}

shm::FileDescriptor make_socket() {
  return shm::FileDescriptor(::socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC, 0));
}

// On the loopback interface.
class Receiver {
 public:
  Receiver() : socket_(make_socket()) {
    const int room = 4 << 20;
    ::setsockopt(socket_.get(), SOL_SOCKET, SO_RCVBUF, &room, sizeof room);
    address_.sin_family = AF_INET;
    address_.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    EXPECT_EQ(::bind(socket_.get(), reinterpret_cast<sockaddr*>(&address_), sizeof address_), 0);
    socklen_t size = sizeof address_;
    ::getsockname(socket_.get(), reinterpret_cast<sockaddr*>(&address_), &size);
  }
  sockaddr_in& address() { return address_; }
  // All that have come: what is sent on this interface is there at once.
  std::vector<Datagram> take() const {
    std::vector<Datagram> all;
    std::array<std::uint8_t, 65536> bytes{};
    for (;;) {
      const ssize_t got = ::recv(socket_.get(), bytes.data(), bytes.size(), MSG_DONTWAIT);
      if (got < 0) return all;
      all.emplace_back(bytes.begin(), bytes.begin() + got);
    }
  }

 private:
  shm::FileDescriptor socket_;
  sockaddr_in address_{};
};

class Trains : public ::testing::Test {
 protected:
  // In two parts, as Cyclone's headers and payloads are.
  void send(Receiver& to, const Datagram& bytes) {
    const std::size_t first = bytes.size() / 3;
    auto* const begin = const_cast<std::uint8_t*>(bytes.data());
    std::array<iovec, 2> parts{{{begin, first}, {begin + first, bytes.size() - first}}};
    msghdr message{};
    message.msg_name = &to.address();
    message.msg_namelen = sizeof to.address();
    message.msg_iov = parts.data();
    message.msg_iovlen = parts.size();
    ssize_t sent = 0;
    EXPECT_EQ(ddsrt_sendmsg(socket_.get(), &message, 0, &sent), DDS_RETCODE_OK);
    EXPECT_EQ(static_cast<std::size_t>(sent), bytes.size());
  }

  const shm::FileDescriptor socket_ = make_socket();
  const std::unique_ptr<DatagramTrain> train_ = std::make_unique<DatagramTrain>();
  Receiver receiver_;
};

TEST_F(Trains, CarryDatagramsAsTheyAre) {
  std::vector<Datagram> sent;
  for (std::size_t i = 0; i < 80; ++i) sent.push_back(datagram(i == 79 ? 77 : 1396, i));
  {
    const DatagramTrain::Boarding boarding(*train_);
    for (const Datagram& each : sent) send(receiver_, each);
  }
  EXPECT_EQ(receiver_.take(), sent);
}

TEST_F(Trains, LeaveWhenTheyDepartAndWhenNobodyBoardsAnyMore) {
  {
    const DatagramTrain::Boarding boarding(*train_);
    send(receiver_, datagram(100, 1));
    send(receiver_, datagram(100, 2));
    EXPECT_TRUE(receiver_.take().empty());
    train_->depart();
    EXPECT_EQ(receiver_.take().size(), 2U);
    send(receiver_, datagram(100, 3));
  }
  EXPECT_EQ(receiver_.take().size(), 1U);
}

TEST_F(Trains, AreOnlyForWhoBoards) {
  send(receiver_, datagram(100, 1));
  EXPECT_EQ(receiver_.take().size(), 1U);
}

TEST_F(Trains, KeepTheOrderForEachReceiver) {
  Receiver other;
  std::array<std::vector<Datagram>, 2> sent;
  std::mt19937 random(7);
  {
    const DatagramTrain::Boarding boarding(*train_);
    for (std::size_t i = 0; i < 150; ++i) {
      const std::size_t to = random() % 8 == 0 ? 1 : 0;
      const std::size_t bytes = random() % 4 == 0 ? 1 + random() % 1400 : 500;
      sent.at(to).push_back(datagram(bytes, i));
      send(to == 0 ? receiver_ : other, sent.at(to).back());
    }
  }
  EXPECT_EQ(receiver_.take(), sent[0]);
  EXPECT_EQ(other.take(), sent[1]);
}

// As where the network interface cannot.
TEST_F(Trains, LeaveOneByOneWhereTheyCannotLeaveTogether) {
  const int without = 1;
  ASSERT_EQ(::setsockopt(socket_.get(), SOL_SOCKET, SO_NO_CHECK, &without, sizeof without), 0);
  std::vector<Datagram> sent;
  for (std::size_t i = 0; i < 50; ++i) sent.push_back(datagram(i == 49 ? 5 : 300, i));
  {
    const DatagramTrain::Boarding boarding(*train_);
    for (const Datagram& each : sent) send(receiver_, each);
  }
  EXPECT_EQ(receiver_.take(), sent);
}

}  // namespace
}  // namespace arbiter::link
