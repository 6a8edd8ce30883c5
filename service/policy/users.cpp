#include "service/policy/users.hpp"

#include <pwd.h>
#include <sys/socket.h>

#include <array>
#include <cerrno>
#include <cstdio>
#include <memory>
#include <system_error>
#include <vector>

namespace arbiter::service {

// The name is that of /etc/passwd. A name service may ask a network that is not there, and take
// half a minute: all clients would wait because one was refused.
std::string describe_user(uid_t user) {
  const std::unique_ptr<FILE, int (*)(FILE*)> accounts(
      std::fopen("/etc/passwd", "re"), [](FILE* file) { return std::fclose(file); });
  passwd entry{};
  passwd* found = nullptr;
  std::array<char, 4096> buffer;
  while (accounts != nullptr &&
         fgetpwent_r(accounts.get(), &entry, buffer.data(), buffer.size(), &found) == 0) {
    if (entry.pw_uid == user) return entry.pw_name + (" (" + std::to_string(user) + ")");
  }
  return std::to_string(user);
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
