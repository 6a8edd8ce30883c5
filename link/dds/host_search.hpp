// Datagrams to where hosts are looked for by address (--peer): each address has a socket of its
// own.
//
// Cyclone announces this host four times a second at each of 33 ports of each such address, be
// somebody there or not. What goes to a machine that is off the kernel keeps for up to three
// seconds, until nobody has said where it is (ARP), and counts it as not sent yet. By the one
// socket by which Cyclone sends everything, two machines that are off would fill its buffer:
// whoever sends to others waits then, for seconds, and so they take this host for gone. So what is
// said there about discovery, which DDS repeats, leaves by other sockets, and is lost where they
// are full.
//
// Thread safety: any thread.
#pragma once

#include <netinet/in.h>
#include <sys/socket.h>

#include <array>
#include <atomic>
#include <cstddef>
#include <cstdint>
#include <mutex>

#include "shm/file_descriptor.hpp"

namespace arbiter::link {

class HostSearch {
 public:
  // Of addresses. What goes to more takes their sockets in turn.
  static constexpr std::size_t kMost = 64;
  // Of a participant's ports for discovery, from the first of its domain: each second one.
  static constexpr unsigned kParticipants = 33;

  // The one by which Cyclone's datagrams leave.
  static HostSearch& of_process();

  // From now on those of this domain are taken.
  void begin(std::uint32_t domain) noexcept;

  // Sends it as `socket` would, but waits for next to nothing. False: it is none of those, or no
  // socket is left for it.
  [[nodiscard]] bool send(int socket, const msghdr& message, int flags) noexcept;

 private:
  struct Way {
    in_addr_t from = INADDR_ANY;
    in_addr_t to = INADDR_ANY;
    bool is_full = false;
    shm::FileDescriptor socket;
  };
  [[nodiscard]] Way* way_to(in_addr_t address, int socket) noexcept;

  std::atomic<unsigned> first_port_{0};  // 0: none are taken
  std::mutex mutex_;
  std::array<Way, kMost> ways_;
  std::size_t next_ = 0;  // of them, to be used for another address
};

}  // namespace arbiter::link
