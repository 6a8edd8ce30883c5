#include "gateway/iceoryx/runtime.hpp"

#include <unistd.h>

#include <charconv>

#include <iceoryx_hoofs/platform/platform_settings.hpp>

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

void remove_traces(const std::string& runtime) {
  const std::string socket = iox::platform::IOX_UDS_SOCKET_PATH_PREFIX + runtime;
  const std::string lock = iox::platform::IOX_LOCK_FILE_PATH_PREFIX + runtime + ".lock";
  ::unlink(socket.c_str());
  ::unlink(lock.c_str());
}

}  // namespace arbiter::gateway
