// Datagrams of one thread to the same address, handed to the kernel in one call.
//
// A large sample leaves as hundreds of datagrams that each fit the network (network.cpp), and
// Cyclone has one system call for each: its way through the kernel, from socket to socket, costs
// far more than its bytes. Linux takes a train of equal datagrams at once (UDP_SEGMENT): they go
// through the kernel as one, are cut apart where they leave the machine, and are the same on the
// wire. Cyclone knows no such setting, so this library defines ddsrt_sendmsg(), by which Cyclone
// sends, and its own is not called: a program's function comes before that of a shared library of
// the same name. Should Cyclone cease to call it, each datagram leaves alone, as before.
//
// Where multicast does not reach, Cyclone sends each datagram to one address after another: each
// has a train of its own.
//
// Thread safety: one thread at a time; Boarding says which.
#pragma once

#include <sys/socket.h>

#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <vector>

#include "link/core/train_pace.hpp"
#include "shm/activity.hpp"
#include "shm/clock.hpp"

namespace arbiter::link {

// Large datagrams that threads of Cyclone's own have sent in this process: repetitions, but for the
// last sample of a source, which a host that joins is sent, and what is said when hosts meet.
[[nodiscard]] std::uint64_t repeated_datagrams() noexcept;

class DatagramTrains {
 public:
  // What goes to others meanwhile leaves alone.
  static constexpr std::size_t kMostAddresses = 16;
  // An address that trains cannot reach is tried again after so long: its way may be another one.
  static constexpr shm::Nanoseconds kTryAgain = 5'000'000'000;

  using Clock = shm::Nanoseconds (*)() noexcept;
  explicit DatagramTrains(Clock clock = shm::monotonic_now) noexcept
      : now_(clock), pace_(repeated_datagrams()) {}
  DatagramTrains(const DatagramTrains&) = delete;
  DatagramTrains& operator=(const DatagramTrains&) = delete;
  ~DatagramTrains() = default;

  // While it lives, what its thread sends through Cyclone boards a train. One at a time in a
  // thread.
  class Boarding {
   public:
    explicit Boarding(DatagramTrains& trains) noexcept;
    Boarding(const Boarding&) = delete;
    Boarding& operator=(const Boarding&) = delete;
    ~Boarding();  // all depart
  };

  // Takes a copy, which leaves later, behind those to that address that are on board; a datagram
  // that cannot be sent then is lost, as any may be. False: it is to be sent by itself, now.
  [[nodiscard]] bool board(int socket, const msghdr& message, int flags) noexcept;
  // What is on board leaves now.
  void depart() noexcept;

 private:
  // What Linux takes at once: 64 datagrams, and what IP can say the length of.
  static constexpr std::size_t kMostDatagrams = 64;
  static constexpr std::size_t kMostBytes = 65'000;

  struct Train {
    [[nodiscard]] bool is_to(int to_socket, const msghdr& message, int with_flags) const noexcept;
    [[nodiscard]] bool fits(std::size_t size) const noexcept;
    void assign(int to_socket, const msghdr& message, int with_flags) noexcept;
    void add(const msghdr& message, std::size_t size) noexcept;
    [[nodiscard]] bool depart_together() noexcept;
    void depart_alone() noexcept;
    [[nodiscard]] msghdr message_of(iovec& part) noexcept;  // to the address

    int socket = -1;
    int flags = 0;
    sockaddr_storage address{};
    socklen_t address_bytes = 0;
    shm::Nanoseconds alone_until = 0;  // what goes there leaves one by one
    // Of those on board; all but the last have `each` bytes.
    std::size_t count = 0;
    std::size_t each = 0;
    std::size_t bytes = 0;
    bool is_closed = false;  // the last one is shorter: nothing may follow it
    std::array<std::byte, kMostBytes> buffer;
  };

  // Null: there is no place for it.
  [[nodiscard]] Train* train_to(int socket, const msghdr& message, int flags) noexcept;
  void depart(Train& train) noexcept;

  const Clock now_;
  std::vector<std::unique_ptr<Train>> trains_;
  TrainPace pace_;
};

}  // namespace arbiter::link
