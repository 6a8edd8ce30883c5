#include "link/dds/host_search.hpp"

#include <sys/time.h>

#include <algorithm>
#include <cerrno>

namespace arbiter::link {
namespace {

// As much as the kernel lets everybody have: more than it keeps for a machine that it cannot find.
constexpr int kSendBuffer = 212'992;
// For an address that has been reached so far.
constexpr timeval kLongestWait{0, 20'000};

// By the interface that `socket` is bound to.
shm::FileDescriptor make_way(const sockaddr_in& from) noexcept {
  shm::FileDescriptor made(::socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC, 0));
  if (!made) return made;
  if (::bind(made.get(), reinterpret_cast<const sockaddr*>(&from), sizeof from) != 0) return {};
  const int none = 0;  // nobody reads
  ::setsockopt(made.get(), SOL_SOCKET, SO_RCVBUF, &none, sizeof none);
  ::setsockopt(made.get(), SOL_SOCKET, SO_SNDBUF, &kSendBuffer, sizeof kSendBuffer);
  ::setsockopt(made.get(), SOL_SOCKET, SO_SNDTIMEO, &kLongestWait, sizeof kLongestWait);
  return made;
}

}  // namespace

// Never destroyed: Cyclone's threads may send until the process ends.
HostSearch& HostSearch::of_process() {
  static HostSearch& made = *new HostSearch;
  return made;
}

// As RTPS has it.
void HostSearch::begin(std::uint32_t domain) noexcept { first_port_ = 7400 + 250 * domain + 10; }

bool HostSearch::send(int socket, const msghdr& message, int flags) noexcept {
  const unsigned first = first_port_;
  const auto* const to = static_cast<const sockaddr_in*>(message.msg_name);
  if (first == 0 || to == nullptr || message.msg_namelen < sizeof *to) return false;
  if (to->sin_family != AF_INET) return false;
  const unsigned beyond = ntohs(to->sin_port) - first;  // large, where it is below
  if (beyond >= 2 * kParticipants || beyond % 2 != 0) return false;
  const std::lock_guard lock(mutex_);
  Way* const way = way_to(to->sin_addr.s_addr, socket);
  if (way == nullptr) return false;
  const int wait = way->is_full ? MSG_DONTWAIT : 0;
  ssize_t sent = 0;
  do sent = ::sendmsg(way->socket.get(), &message, flags | wait);
  while (sent < 0 && errno == EINTR);
  way->is_full = sent < 0 && errno == EAGAIN;
  return true;
}

HostSearch::Way* HostSearch::way_to(in_addr_t address, int socket) noexcept {
  sockaddr_in from{};
  socklen_t size = sizeof from;
  if (::getsockname(socket, reinterpret_cast<sockaddr*>(&from), &size) != 0 ||
      from.sin_family != AF_INET) {
    return nullptr;
  }
  const auto known = std::find_if(ways_.begin(), ways_.end(), [&](const Way& each) {
    return each.socket && each.to == address && each.from == from.sin_addr.s_addr;
  });
  if (known != ways_.end()) return &*known;
  from.sin_port = 0;
  shm::FileDescriptor made = make_way(from);
  if (!made) return nullptr;
  Way& way = ways_[next_];
  next_ = (next_ + 1) % kMost;
  way = {from.sin_addr.s_addr, address, false, std::move(made)};
  return &way;
}

}  // namespace arbiter::link
