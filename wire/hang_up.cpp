#include "wire/hang_up.hpp"

#include <sys/socket.h>

#include <algorithm>
#include <cerrno>
#include <utility>

#include "wire/errands.hpp"

namespace arbiter::wire {
namespace {

// The most messages that are looked at before a socket is closed.
constexpr int kMaxUnread = 1024;

// Whether messages that nobody has read bring descriptors, once nobody can send more of them. Each
// look has room for the sender's credentials alone: the end of the conversation brings none, a
// message does, and the kernel says whether more was left out. A look lets go of nothing, so it
// takes no time; and a message without descriptors can be taken.
bool brings_descriptors(int socket) noexcept {
  const int on = 1;
  if (setsockopt(socket, SOL_SOCKET, SO_PASSCRED, &on, sizeof on) != 0) return true;
  for (int i = 0; i < kMaxUnread; ++i) {
    alignas(cmsghdr) char credentials[CMSG_SPACE(sizeof(ucred))];
    msghdr header{};
    header.msg_control = credentials;
    header.msg_controllen = sizeof credentials;
    if (recvmsg(socket, &header, MSG_PEEK | MSG_DONTWAIT | MSG_CMSG_CLOEXEC) < 0) {
      if (errno == ECONNRESET) continue;  // said once, before what was sent
      return true;
    }
    if (header.msg_controllen == 0) return false;
    if ((header.msg_flags & MSG_CTRUNC) != 0) return true;
    static_cast<void>(!recv(socket, nullptr, 0, MSG_DONTWAIT));
  }
  return true;
}

}  // namespace

// Most conversations end with nothing unread, or nothing that takes time.
void hang_up(shm::FileDescriptor socket, uid_t user) {
  if (!socket) return;
  ::shutdown(socket.get(), SHUT_RDWR);
  if (brings_descriptors(socket.get())) {
    Errands::of_the_process().close(user, std::move(socket));
  }
}

void dispose_of(Received& received, uid_t user) {
  const auto dispose = [&](shm::FileDescriptor& descriptor) {
    Errands::of_the_process().close(user, std::move(descriptor));
  };
  std::for_each(received.descriptors.begin(), received.descriptors.end(), dispose);
  std::for_each(received.surplus.begin(), received.surplus.end(), dispose);
}

}  // namespace arbiter::wire
