// Descriptors that take for ever to close, and sending them to who did not ask for any.
#pragma once

#include <netinet/in.h>
#include <sys/socket.h>

#include <cstddef>
#include <cstring>
#include <span>
#include <stdexcept>
#include <vector>

#include "shm/file_descriptor.hpp"

namespace arbiter::test {

// A TCP connection whose peer does not read: closing it waits for an hour. The last who closes it
// waits; so whoever sends it stops the receiver, closes its own, and lets the receiver go on.
class Lingering {
 public:
  Lingering() {
    const shm::FileDescriptor listener(::socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0));
    sockaddr_in address{};
    address.sin_family = AF_INET;
    address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    auto* const name = reinterpret_cast<sockaddr*>(&address);
    socklen_t size = sizeof address;
    require(::bind(listener.get(), name, size) == 0 && ::listen(listener.get(), 1) == 0 &&
            ::getsockname(listener.get(), name, &size) == 0);
    end_.reset(::socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0));
    require(::connect(end_.get(), name, size) == 0);
    peer_.reset(::accept4(listener.get(), nullptr, nullptr, SOCK_CLOEXEC));
    const linger an_hour{1, 3600};
    require(peer_ &&
            ::setsockopt(end_.get(), SOL_SOCKET, SO_LINGER, &an_hour, sizeof an_hour) == 0);
    const std::vector<char> unread(1 << 16);
    while (::send(end_.get(), unread.data(), unread.size(), MSG_DONTWAIT) > 0) {
    }
  }

  [[nodiscard]] int get() const { return end_.get(); }
  void close() { end_.reset(); }
  // Closing it waits no more.
  void release() { peer_.reset(); }

 private:
  static void require(bool succeeded) {
    if (!succeeded) throw std::runtime_error("a connection to linger at cannot be made");
  }
  shm::FileDescriptor end_;
  shm::FileDescriptor peer_;
};

// Any number of descriptors, more than a client library would send. False: nobody listens.
inline bool try_to_send_with(int socket, std::span<const std::byte> bytes,
                             const std::vector<int>& descriptors) {
  iovec data{const_cast<std::byte*>(bytes.data()), bytes.size()};
  std::vector<char> control(CMSG_SPACE(sizeof(int) * descriptors.size()));
  msghdr header{};
  header.msg_iov = &data;
  header.msg_iovlen = 1;
  header.msg_control = control.data();
  header.msg_controllen = control.size();
  cmsghdr* const part = CMSG_FIRSTHDR(&header);
  part->cmsg_level = SOL_SOCKET;
  part->cmsg_type = SCM_RIGHTS;
  part->cmsg_len = CMSG_LEN(sizeof(int) * descriptors.size());
  std::memcpy(CMSG_DATA(part), descriptors.data(), sizeof(int) * descriptors.size());
  return ::sendmsg(socket, &header, MSG_NOSIGNAL) > 0;
}

}  // namespace arbiter::test
