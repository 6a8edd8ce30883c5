#include "bench/harness/program.hpp"

#include <fcntl.h>
#include <poll.h>
#include <signal.h>
#include <stdlib.h>
#include <sys/prctl.h>
#include <sys/syscall.h>
#include <sys/wait.h>
#include <unistd.h>

#include <atomic>
#include <cerrno>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <system_error>
#include <utility>

namespace arbiter::bench {

namespace {

std::atomic<pid_t> supervised{0};
static_assert(std::atomic<pid_t>::is_always_lock_free, "for a signal handler");

void pass_on(int number) { ::kill(supervised.load(), number); }

}  // namespace

Program::Program(const std::vector<std::string>& argv, const Variables& variables,
                 const std::string& log) {
  const pid_t parent = ::getpid();
  pid_ = ::fork();
  if (pid_ < 0) throw std::system_error(errno, std::generic_category(), "fork");
  if (pid_ != 0) return;
  ::prctl(PR_SET_PDEATHSIG, SIGKILL);
  if (::getppid() != parent) ::_exit(126);
  ::setpgid(0, 0);  // Ctrl-C is the benchmark's to hear; it ends its programs in order
  for (const auto& [name, value] : variables) {
    value ? ::setenv(name.c_str(), value->c_str(), 1) : ::unsetenv(name.c_str());
  }
  const int in = ::open("/dev/null", O_RDONLY);
  const int out = ::open(log.c_str(), O_WRONLY | O_CREAT | O_APPEND, 0600);
  if (in < 0 || out < 0) ::_exit(126);
  ::dup2(in, STDIN_FILENO);
  ::dup2(out, STDOUT_FILENO);
  ::dup2(out, STDERR_FILENO);
  std::vector<char*> arguments;
  for (const std::string& each : argv) arguments.push_back(const_cast<char*>(each.c_str()));
  arguments.push_back(nullptr);
  ::execv(arguments[0], arguments.data());
  ::_exit(127);
}

Program::Program(Program&& other) noexcept
    : pid_(std::exchange(other.pid_, -1)), exit_code_(other.exit_code_) {}

Program& Program::operator=(Program&& other) noexcept {
  if (this != &other) {
    end();
    pid_ = std::exchange(other.pid_, -1);
    exit_code_ = other.exit_code_;
  }
  return *this;
}

Program::~Program() { end(); }

// Of all its threads: a child belongs to the thread that has started it.
std::vector<pid_t> Program::children() const {
  std::vector<pid_t> found;
  std::error_code ignored;
  const std::string tasks = "/proc/" + std::to_string(pid_) + "/task";
  for (const auto& task : std::filesystem::directory_iterator(tasks, ignored)) {
    std::ifstream stream(task.path() / "children");
    for (pid_t child = 0; stream >> child;) found.push_back(child);
  }
  return found;
}

void Program::signal(int number) const { ::kill(pid_, number); }

bool Program::ends_within(std::chrono::milliseconds limit) {
  if (pid_ < 0) return true;
  const int process = static_cast<int>(::syscall(SYS_pidfd_open, pid_, 0));
  if (process < 0) throw std::system_error(errno, std::generic_category(), "pidfd_open");
  pollfd end{process, POLLIN, 0};
  const bool has_ended = ::poll(&end, 1, static_cast<int>(limit.count())) > 0;
  ::close(process);
  if (!has_ended) return false;
  int status = 0;
  ::waitpid(pid_, &status, 0);
  exit_code_ = WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status);
  pid_ = -1;
  return true;
}

void Program::end() noexcept {
  if (pid_ < 0) return;
  ::kill(pid_, SIGTERM);
  ::waitpid(pid_, nullptr, 0);
  pid_ = -1;
}

ScratchDirectory::ScratchDirectory() {
  path_ = std::filesystem::temp_directory_path() / "arbiter-bench-XXXXXX";
  if (::mkdtemp(path_.data()) == nullptr) {
    throw std::system_error(errno, std::generic_category(), "mkdtemp " + path_);
  }
}

ScratchDirectory::~ScratchDirectory() {
  std::error_code ignored;
  std::filesystem::remove_all(path_, ignored);
}

int run_and_clear_up(const std::function<int()>& work) {
  const ScratchDirectory scratch;
  ::prctl(PR_SET_CHILD_SUBREAPER, 1);  // what outlives its parent becomes a child of ours
  const pid_t parent = ::getpid();
  const pid_t child = ::fork();
  if (child < 0) throw std::system_error(errno, std::generic_category(), "fork");
  if (child == 0) {
    ::prctl(PR_SET_PDEATHSIG, SIGKILL);
    if (::getppid() != parent) ::_exit(1);
    ::setenv("TMPDIR", scratch.path().c_str(), 1);
    std::exit(work());
  }
  supervised = child;
  ::signal(SIGTERM, pass_on);
  ::signal(SIGINT, SIG_IGN);  // the terminal has sent it to the child as well
  ::signal(SIGHUP, SIG_IGN);
  int result = 1;
  for (;;) {
    int status = 0;
    const pid_t ended = ::waitpid(-1, &status, 0);
    if (ended < 0 && errno == EINTR) continue;
    if (ended < 0) return result;
    if (ended == child) result = WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status);
  }
}

std::string program_directory() {
  return std::filesystem::read_symlink("/proc/self/exe").parent_path();
}

}  // namespace arbiter::bench
