#include "gateway/iceoryx/roudi.hpp"

#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/un.h>

#include <cstring>

#include <iceoryx_hoofs/platform/platform_settings.hpp>
#include <iceoryx_posh/iceoryx_posh_types.hpp>

#include "shm/file_descriptor.hpp"

namespace arbiter::gateway {

std::string roudi_socket_path() {
  return std::string(iox::platform::IOX_UDS_SOCKET_PATH_PREFIX) +
         iox::roudi::IPC_CHANNEL_ROUDI_NAME;
}

// The file outlives a RouDi that was killed; but then nobody has it bound, and the kernel refuses
// to connect.
std::optional<RoudiIdentity> find_roudi(const std::string& socket_path) {
  sockaddr_un address{};
  address.sun_family = AF_UNIX;
  if (socket_path.size() >= sizeof address.sun_path) return {};
  std::memcpy(address.sun_path, socket_path.data(), socket_path.size());
  const shm::FileDescriptor socket(::socket(AF_UNIX, SOCK_DGRAM | SOCK_CLOEXEC, 0));
  struct stat before {};
  struct stat after {};
  if (!socket || ::stat(socket_path.c_str(), &before) != 0) return {};
  if (::connect(socket.get(), reinterpret_cast<const sockaddr*>(&address), sizeof address) != 0) {
    return {};
  }
  // Another one may have come in between.
  if (::stat(socket_path.c_str(), &after) != 0 || before.st_ino != after.st_ino) return {};
  return RoudiIdentity{
      before.st_dev, before.st_ino,
      std::int64_t{before.st_ctim.tv_sec} * 1'000'000'000 + before.st_ctim.tv_nsec};
}

}  // namespace arbiter::gateway
