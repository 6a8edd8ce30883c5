#include "service/kept/process.hpp"

#include <poll.h>

#include <fstream>
#include <iterator>
#include <sstream>
#include <string>

namespace arbiter::service {

// The 22nd field of /proc/PID/stat. The 2nd is a name in brackets, of any characters.
std::uint64_t start_of_process(pid_t pid) {
  std::ifstream file("/proc/" + std::to_string(pid) + "/stat");
  const std::string text{std::istreambuf_iterator<char>(file), {}};
  const auto name_end = text.rfind(')');
  if (name_end == std::string::npos) return 0;
  std::istringstream fields(text.substr(name_end + 1));
  std::string field;
  for (int i = 3; i <= 21; ++i) fields >> field;
  std::uint64_t started = 0;
  fields >> started;
  return started;
}

bool Process::lives() const { return pid > 0 && start_of_process(pid) == started; }

bool has_ended(const shm::FileDescriptor& process) {
  pollfd polled{process.get(), POLLIN, 0};
  return process && ::poll(&polled, 1, 0) == 1;
}

}  // namespace arbiter::service
