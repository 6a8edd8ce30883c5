// Datagrams of one thread to one address, handed to the kernel in one call.
//
// A large sample leaves as hundreds of datagrams that each fit the network (network.cpp), and
// Cyclone has one system call for each: its way through the kernel, from socket to socket, costs
// far more than its bytes. Linux takes a train of equal datagrams at once (UDP_SEGMENT): they go
// through the kernel as one, are cut apart where they leave the machine, and are the same on the
// wire. Cyclone knows no such setting, so this library defines ddsrt_sendmsg(), by which Cyclone
// sends, and its own is not called: a program's function comes before that of a shared library of
// the same name. Should Cyclone cease to call it, each datagram leaves alone, as before.
//
// Thread safety: one thread at a time; Boarding says which.
#pragma once

#include <sys/socket.h>

#include <array>
#include <cstddef>

#include "link/core/train_pace.hpp"

namespace arbiter::link {

class DatagramTrain {
 public:
  DatagramTrain() = default;
  DatagramTrain(const DatagramTrain&) = delete;
  DatagramTrain& operator=(const DatagramTrain&) = delete;
  ~DatagramTrain() = default;

  // While it lives, what its thread sends through Cyclone boards the train. One at a time in a
  // thread.
  class Boarding {
   public:
    explicit Boarding(DatagramTrain& train) noexcept;
    Boarding(const Boarding&) = delete;
    Boarding& operator=(const Boarding&) = delete;
    ~Boarding();  // it departs
  };

  // Takes a copy, which leaves later, behind those that are on board; a datagram that cannot be
  // sent then is lost, as any may be. False: it is to be sent by itself, now.
  [[nodiscard]] bool board(int socket, const msghdr& message, int flags) noexcept;
  // What is on board leaves now.
  void depart() noexcept;

 private:
  // What Linux takes at once: 64 datagrams, and what IP can say the length of.
  static constexpr std::size_t kMostDatagrams = 64;
  static constexpr std::size_t kMostBytes = 65'000;

  [[nodiscard]] bool fits(int socket, const msghdr& message, int flags,
                          std::size_t size) const noexcept;
  [[nodiscard]] bool depart_together() noexcept;
  void depart_alone() noexcept;

  // Of those on board; all but the last have each_ bytes.
  std::size_t count_ = 0;
  std::size_t each_ = 0;
  std::size_t bytes_ = 0;
  bool is_closed_ = false;  // the last one is shorter: nothing may follow it
  int socket_ = -1;
  int flags_ = 0;
  sockaddr_storage address_{};
  socklen_t address_bytes_ = 0;
  bool can_depart_together_ = true;  // by this kernel, this network
  TrainPace pace_;
  std::array<std::byte, kMostBytes> buffer_;
};

}  // namespace arbiter::link
