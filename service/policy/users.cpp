#include "service/policy/users.hpp"

#include <pwd.h>
#include <sys/socket.h>

#include <cerrno>
#include <system_error>
#include <vector>

namespace arbiter::service {

std::string describe_user(uid_t user) {
  passwd entry{};
  passwd* found = nullptr;
  std::vector<char> buffer(4096);
  if (getpwuid_r(user, &entry, buffer.data(), buffer.size(), &found) != 0 || found == nullptr) {
    return std::to_string(user);
  }
  return entry.pw_name + (" (" + std::to_string(user) + ")");
}

Identity peer_identity(int socket) {
  ucred peer{};
  socklen_t size = sizeof peer;
  if (getsockopt(socket, SOL_SOCKET, SO_PEERCRED, &peer, &size) != 0) {
    throw std::system_error(errno, std::generic_category(), "asking who connects");
  }
  Identity identity{peer.uid, std::vector<gid_t>(32)};
  for (;;) {
    size = static_cast<socklen_t>(identity.groups.size() * sizeof(gid_t));
    const int result = getsockopt(socket, SOL_SOCKET, SO_PEERGROUPS, identity.groups.data(), &size);
    if (result != 0 && errno != ERANGE) {
      throw std::system_error(errno, std::generic_category(), "asking for a client's groups");
    }
    identity.groups.resize(size / sizeof(gid_t));
    if (result == 0) break;
  }
  identity.groups.push_back(peer.gid);
  return identity;
}

}  // namespace arbiter::service
