#include "service/kept/process.hpp"

#include <poll.h>
#include <signal.h>

#include <cerrno>
#include <filesystem>
#include <fstream>
#include <sstream>
#include <string>
#include <system_error>

namespace arbiter::service {
namespace {

// Whoever has more of them, all ended and kept by a debugger, does not hold up who looks.
constexpr int kMaxThreads = 64;

struct ProcessStatus {
  char state = 0;
  int threads = 0;
  std::uint64_t started = 0;
  std::uint64_t memory = 0;  // bytes; none after its end
};

// Fields 3, 20, 22 and 23 of a file such as /proc/PID/stat. The 2nd is a name in brackets, of any
// characters.
ProcessStatus read_status(const std::string& path) {
  std::ifstream file(path);
  // A process that ends before it is read is an error of the file, which an iterator would throw.
  std::string text;
  std::getline(file, text, '\0');
  const auto name_end = text.rfind(')');
  if (name_end == std::string::npos) return {};
  std::istringstream fields(text.substr(name_end + 1));
  ProcessStatus status;
  std::string field;
  fields >> status.state;
  for (int i = 4; i <= 19; ++i) fields >> field;
  fields >> status.threads >> field >> status.started >> status.memory;
  return status;
}

ProcessStatus status_of(pid_t pid) { return read_status("/proc/" + std::to_string(pid) + "/stat"); }

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

bool is_ending(pid_t pid) {
  if (pid <= 0) return false;
  std::error_code error;
  std::filesystem::directory_iterator thread("/proc/" + std::to_string(pid) + "/task", error);
  int looked_at = 0;
  for (; !error && thread != std::filesystem::directory_iterator(); thread.increment(error)) {
    const ProcessStatus status = read_status(thread->path().string() + "/stat");
    const bool has_gone = status.state == 0 && !std::filesystem::exists(thread->path(), error);
    const bool may_go_on = status.state == 0 ? !has_gone : status.memory != 0;
    if (may_go_on || ++looked_at > kMaxThreads) return false;
  }
  return looked_at != 0 && !error;
}

bool has_ended(const shm::FileDescriptor& process) {
  pollfd polled{process.get(), POLLIN, 0};
  return process && ::poll(&polled, 1, 0) == 1;
}

}  // namespace arbiter::service
