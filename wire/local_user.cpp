#include "wire/local_user.hpp"

#include <sys/socket.h>

#include <cerrno>
#include <system_error>

namespace arbiter::wire {

LocalUser user_at(int socket) {
  ucred peer{};
  socklen_t size = sizeof peer;
  if (getsockopt(socket, SOL_SOCKET, SO_PEERCRED, &peer, &size) != 0) {
    throw std::system_error(errno, std::generic_category(), "asking who connects");
  }
  LocalUser who{peer.uid, std::vector<gid_t>(32)};
  for (;;) {
    size = static_cast<socklen_t>(who.groups.size() * sizeof(gid_t));
    const int result = getsockopt(socket, SOL_SOCKET, SO_PEERGROUPS, who.groups.data(), &size);
    if (result != 0 && errno != ERANGE) {
      throw std::system_error(errno, std::generic_category(), "asking for a user's groups");
    }
    who.groups.resize(size / sizeof(gid_t));
    if (result == 0) break;
  }
  who.groups.push_back(peer.gid);
  return who;
}

}  // namespace arbiter::wire
