#include "service/kept/process.hpp"

#include <poll.h>
#include <signal.h>

#include <cerrno>
#include <fstream>
#include <iterator>
#include <sstream>
#include <string>

namespace arbiter::service {
namespace {

struct ProcessStatus {
  char state = 0;
  int threads = 0;
  std::uint64_t started = 0;
};

// Fields 3, 20 and 22 of /proc/PID/stat. The 2nd is a name in brackets, of any characters.
ProcessStatus status_of(pid_t pid) {
  std::ifstream file("/proc/" + std::to_string(pid) + "/stat");
  const std::string text{std::istreambuf_iterator<char>(file), {}};
  const auto name_end = text.rfind(')');
  if (name_end == std::string::npos) return {};
  std::istringstream fields(text.substr(name_end + 1));
  ProcessStatus status;
  std::string field;
  fields >> status.state;
  for (int i = 4; i <= 19; ++i) fields >> field;
  fields >> status.threads >> field >> status.started;
  return status;
}

// What has ended stays until its parent asks how; so does a first thread that ended before others.
bool has_ended(const ProcessStatus& status) {
  return (status.state == 'Z' || status.state == 'X') && status.threads <= 1;
}

}  // namespace

std::uint64_t start_of_process(pid_t pid) { return status_of(pid).started; }

bool Process::lives() const {
  if (pid <= 0 || started == 0) return false;
  const ProcessStatus status = status_of(pid);
  return status.started == started && !has_ended(status);
}

bool Process::has_surely_ended() const {
  if (pid <= 0 || started == 0) return true;
  const ProcessStatus status = status_of(pid);
  if (status.started == 0) return ::kill(pid, 0) != 0 && errno == ESRCH;  // it cannot be read
  return status.started != started || has_ended(status);
}

bool has_ended(const shm::FileDescriptor& process) {
  pollfd polled{process.get(), POLLIN, 0};
  return process && ::poll(&polled, 1, 0) == 1;
}

}  // namespace arbiter::service
