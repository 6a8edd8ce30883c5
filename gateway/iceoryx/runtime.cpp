#include "gateway/iceoryx/runtime.hpp"

#include <fcntl.h>
#include <sys/statvfs.h>
#include <unistd.h>

#include <cerrno>
#include <charconv>
#include <filesystem>

#include <iceoryx_hoofs/platform/platform_settings.hpp>

#include "shm/file_descriptor.hpp"

namespace arbiter::gateway {

std::string runtime_name(const std::string& gateway, int pid) {
  return gateway + "-" + std::to_string(pid);
}

std::optional<pid_t> process_of(const std::string& gateway, const std::string& runtime) {
  const std::string begin = gateway + "-";
  if (!runtime.starts_with(begin)) return {};
  pid_t pid = 0;
  const char* const end = runtime.data() + runtime.size();
  const auto [rest, fault] = std::from_chars(runtime.data() + begin.size(), end, pid);
  return fault == std::errc() && rest == end && pid > 0 ? std::optional(pid) : std::nullopt;
}

std::string why_no_traces() {
  const shm::FileDescriptor another(::open("/dev/null", O_RDONLY | O_CLOEXEC));
  if (!another && errno == EMFILE) return "the process has no descriptor left (RLIMIT_NOFILE)";
  const std::string directory =
      std::filesystem::path(iox::platform::IOX_LOCK_FILE_PATH_PREFIX).parent_path().string();
  struct statvfs room {};
  if (::statvfs(directory.c_str(), &room) != 0) return directory + " is not there";
  if (room.f_files != 0 && room.f_favail == 0) return directory + " has no room for more files";
  if (room.f_bavail == 0) return directory + " is full";
  if (::access(directory.c_str(), W_OK) != 0) return directory + " may not be written";
  return {};
}

void remove_traces(const std::string& runtime) {
  const std::string socket = iox::platform::IOX_UDS_SOCKET_PATH_PREFIX + runtime;
  const std::string lock = iox::platform::IOX_LOCK_FILE_PATH_PREFIX + runtime + ".lock";
  ::unlink(socket.c_str());
  ::unlink(lock.c_str());
}

}  // namespace arbiter::gateway
