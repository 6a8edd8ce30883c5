#include "watch/abandoned_sockets.hpp"

#include <sys/socket.h>
#include <sys/un.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <filesystem>
#include <system_error>

#include "shm/file_descriptor.hpp"

namespace arbiter::watch {
namespace {

namespace fs = std::filesystem;

constexpr std::size_t kMost = 64;

bool is_abandoned(const std::string& path) {
  sockaddr_un address{};
  address.sun_family = AF_UNIX;
  if (path.size() >= sizeof address.sun_path) return false;
  std::memcpy(address.sun_path, path.c_str(), path.size());
  const shm::FileDescriptor probe(
      ::socket(AF_UNIX, SOCK_SEQPACKET | SOCK_NONBLOCK | SOCK_CLOEXEC, 0));
  return probe &&
         ::connect(probe.get(), reinterpret_cast<const sockaddr*>(&address), sizeof address) != 0 &&
         errno == ECONNREFUSED;
}

}  // namespace

std::vector<std::string> abandoned_sockets(const std::string& directory) {
  std::vector<std::string> sockets;
  std::error_code error;
  for (fs::directory_iterator entry(directory, error), end; !error && entry != end;
       entry.increment(error)) {
    std::error_code unknown;
    const bool is_socket = entry->symlink_status(unknown).type() == fs::file_type::socket;
    const std::string extension = entry->path().extension();
    if (is_socket && (extension == ".sock" || extension == ".link"))
      sockets.push_back(entry->path().string());
    if (sockets.size() == kMost) break;
  }
  sockets.erase(std::remove_if(sockets.begin(), sockets.end(),
                               [](const std::string& path) { return !is_abandoned(path); }),
                sockets.end());
  std::sort(sockets.begin(), sockets.end());
  return sockets;
}

}  // namespace arbiter::watch
