// Datagrams that leave together: link/dds/datagram_train.hpp. What boards the train is sent as
// Cyclone sends, by ddsrt_sendmsg().
#include "link/dds/datagram_train.hpp"

#include <arpa/inet.h>
#include <dds/ddsi/q_thread.h>
#include <dds/ddsrt/retcode.h>
#include <dds/ddsrt/sockets.h>
#include <gtest/gtest.h>
#include <netinet/in.h>
#include <netinet/udp.h>
#include <sys/socket.h>

#include <array>
#include <cstddef>
#include <cstdint>
#include <random>
#include <utility>
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
  // From now on take() has what came as one as one.
  void take_trains_whole() const {
    const int whole = 1;
    EXPECT_EQ(::setsockopt(socket_.get(), SOL_UDP, UDP_GRO, &whole, sizeof whole), 0);
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

  // By a train to this address; the kernel refuses one whose checksums it may not compute.
  void refuse_trains(bool refuse) const {
    const int without = refuse ? 1 : 0;
    ASSERT_EQ(::setsockopt(socket_.get(), SOL_SOCKET, SO_NO_CHECK, &without, sizeof without), 0);
  }
  // How many pieces the kernel hands over of ten datagrams to one address.
  std::size_t pieces_of_ten() {
    {
      const DatagramTrains::Boarding boarding(trains_);
      for (std::size_t i = 0; i < 10; ++i) send(receiver_, datagram(300, i));
    }
    return receiver_.take().size();
  }

  static inline shm::Nanoseconds now = 0;
  const shm::FileDescriptor socket_ = make_socket();
  DatagramTrains trains_{[]() noexcept { return now; }};
  Receiver receiver_;
};

TEST_F(Trains, CarryDatagramsAsTheyAre) {
  std::vector<Datagram> sent;
  for (std::size_t i = 0; i < 80; ++i) sent.push_back(datagram(i == 79 ? 77 : 1396, i));
  {
    const DatagramTrains::Boarding boarding(trains_);
    for (const Datagram& each : sent) send(receiver_, each);
  }
  EXPECT_EQ(receiver_.take(), sent);
}

TEST_F(Trains, LeaveWhenTheyDepartAndWhenNobodyBoardsAnyMore) {
  {
    const DatagramTrains::Boarding boarding(trains_);
    send(receiver_, datagram(100, 1));
    send(receiver_, datagram(100, 2));
    EXPECT_TRUE(receiver_.take().empty());
    trains_.depart();
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
    const DatagramTrains::Boarding boarding(trains_);
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
  refuse_trains(true);
  std::vector<Datagram> sent;
  for (std::size_t i = 0; i < 50; ++i) sent.push_back(datagram(i == 49 ? 5 : 300, i));
  {
    const DatagramTrains::Boarding boarding(trains_);
    for (const Datagram& each : sent) send(receiver_, each);
  }
  EXPECT_EQ(receiver_.take(), sent);
}

TEST_F(Trains, AreTriedAgainWhereTheyWereRefused) {
  receiver_.take_trains_whole();
  EXPECT_EQ(pieces_of_ten(), 1U);
  refuse_trains(true);
  EXPECT_EQ(pieces_of_ten(), 10U);
  refuse_trains(false);
  now += DatagramTrains::kTryAgain - 1;
  EXPECT_EQ(pieces_of_ten(), 10U);
  ++now;
  EXPECT_EQ(pieces_of_ten(), 1U);
}

TEST_F(Trains, AreRefusedToOneAddressAlone) {
  receiver_.take_trains_whole();
  Receiver other;
  refuse_trains(true);
  {
    const DatagramTrains::Boarding boarding(trains_);
    for (std::size_t i = 0; i < 10; ++i) send(other, datagram(300, i));
  }
  EXPECT_EQ(other.take().size(), 10U);
  refuse_trains(false);
  EXPECT_EQ(pieces_of_ten(), 1U);
}

// As Cyclone sends where multicast does not reach.
TEST_F(Trains, GoToEachOfSeveralAddresses) {
  std::array<Receiver, DatagramTrains::kMostAddresses> receivers;
  std::vector<Datagram> sent;
  {
    const DatagramTrains::Boarding boarding(trains_);
    for (std::size_t i = 0; i < 20; ++i) {
      sent.push_back(datagram(400, i));
      for (Receiver& each : receivers) send(each, sent.back());
    }
    for (const Receiver& each : receivers) EXPECT_TRUE(each.take().empty());
  }
  for (const Receiver& each : receivers) EXPECT_EQ(each.take(), sent);
}

TEST_F(Trains, LeaveWhoHasNoneToGoAlone) {
  std::array<Receiver, DatagramTrains::kMostAddresses + 3> receivers;
  std::vector<Datagram> sent;
  {
    const DatagramTrains::Boarding boarding(trains_);
    for (std::size_t i = 0; i < 20; ++i) {
      sent.push_back(datagram(400, i));
      for (Receiver& each : receivers) send(each, sent.back());
    }
    for (std::size_t i = 0; i < receivers.size(); ++i) {
      const bool has_train = i < DatagramTrains::kMostAddresses;
      EXPECT_EQ(receivers.at(i).take(), has_train ? std::vector<Datagram>() : sent);
    }
  }
  for (std::size_t i = 0; i < DatagramTrains::kMostAddresses; ++i)
    EXPECT_EQ(receivers.at(i).take(), sent);
}

// What this thread sends for the first time is none, however large it is.
TEST_F(Trains, ARepetitionIsWhatAThreadOfCyclonesOwnSends) {
  const std::uint64_t before = repeated_datagrams();
  send(receiver_, datagram(1300, 1));
  EXPECT_EQ(repeated_datagrams(), before);
  thread_state cyclones{};
  cyclones.state = THREAD_STATE_ALIVE;
  thread_state* const own = std::exchange(tsd_thread_state, &cyclones);
  send(receiver_, datagram(1300, 2));
  send(receiver_, datagram(100, 3));
  tsd_thread_state = own;
  EXPECT_EQ(repeated_datagrams(), before + 1);
  EXPECT_EQ(receiver_.take().size(), 3U);
}

}  // namespace
}  // namespace arbiter::link
