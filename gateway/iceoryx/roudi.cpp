#include "gateway/iceoryx/roudi.hpp"

#include <poll.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/un.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <fstream>
#include <sstream>

#include <iceoryx_hoofs/platform/platform_settings.hpp>
#include <iceoryx_posh/iceoryx_posh_types.hpp>

#include "shm/file_descriptor.hpp"
#include "watch/process.hpp"

namespace arbiter::gateway {
namespace {

// None: nobody has it bound.
shm::FileDescriptor connect_to(const std::string& socket_path) {
  sockaddr_un address{};
  address.sun_family = AF_UNIX;
  if (socket_path.size() >= sizeof address.sun_path) return {};
  std::memcpy(address.sun_path, socket_path.data(), socket_path.size());
  shm::FileDescriptor socket(::socket(AF_UNIX, SOCK_DGRAM | SOCK_CLOEXEC, 0));
  const auto* const to = reinterpret_cast<const sockaddr*>(&address);
  if (!socket || ::connect(socket.get(), to, sizeof address) != 0) return {};
  return socket;
}

}  // namespace

std::string roudi_socket_path() {
  return std::string(iox::platform::IOX_UDS_SOCKET_PATH_PREFIX) +
         iox::roudi::IPC_CHANNEL_ROUDI_NAME;
}

// The file outlives a RouDi that was killed; but then nobody has it bound, and the kernel refuses
// to connect.
std::optional<RoudiIdentity> find_roudi(const std::string& socket_path) {
  struct stat before {};
  struct stat after {};
  if (::stat(socket_path.c_str(), &before) != 0 || !connect_to(socket_path)) return {};
  // Another one may have come in between.
  if (::stat(socket_path.c_str(), &after) != 0 || before.st_ino != after.st_ino) return {};
  return RoudiIdentity{
      before.st_dev, before.st_ino,
      std::int64_t{before.st_ctim.tv_sec} * 1'000'000'000 + before.st_ctim.tv_nsec};
}

bool can_be_told(const std::string& socket_path) {
  const shm::FileDescriptor socket = connect_to(socket_path);
  pollfd polled{socket.get(), POLLOUT, 0};
  return socket && ::poll(&polled, 1, 0) == 1;
}

bool is_closed_to_us(const std::string& socket_path) {
  return ::access(socket_path.c_str(), W_OK) != 0 && errno == EACCES;
}

bool are_ours_closed_to(const std::string& socket_path) {
  struct stat roudi {};
  if (::stat(socket_path.c_str(), &roudi) != 0 || roudi.st_uid == 0) return false;
  return roudi.st_uid != ::geteuid() && roudi.st_gid != ::getegid();
}

// It holds a lock as long as it lives. A line of /proc/locks:
// "3: FLOCK  ADVISORY  WRITE 4502 00:27:7 0 EOF".
bool is_roudi_stopped() {
  const std::string path =
      std::string(iox::platform::IOX_LOCK_FILE_PATH_PREFIX) + iox::roudi::ROUDI_LOCK_NAME + ".lock";
  struct stat lock {};
  if (::stat(path.c_str(), &lock) != 0) return false;
  const std::string file = ":" + std::to_string(lock.st_ino);
  std::ifstream locks("/proc/locks");
  for (std::string line; std::getline(locks, line);) {
    std::istringstream words(line);
    std::string number, kind, advisory, access, place;
    int process = 0;
    if (!(words >> number >> kind >> advisory >> access >> process >> place)) continue;
    if (kind == "FLOCK" && place.ends_with(file) && process > 0 && watch::is_stopped(process)) {
      return true;
    }
  }
  return false;
}

}  // namespace arbiter::gateway
