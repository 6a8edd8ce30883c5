#include "processes.hpp"

#include <fcntl.h>
#include <poll.h>
#include <signal.h>
#include <sys/prctl.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <chrono>
#include <cstdlib>
#include <fstream>
#include <sstream>
#include <stdexcept>
#include <system_error>
#include <thread>

#include <arbiter/arbiter.hpp>

namespace search_and_track {
namespace {

using Clock = std::chrono::steady_clock;
using namespace std::chrono_literals;

constexpr auto kTimeToStart = 10s;
constexpr auto kTimeToStop = 2s;

[[noreturn]] void fail(const std::string& what) {
  throw std::system_error(errno, std::generic_category(), what);
}

std::string how_it_ended(int status) {
  if (WIFSIGNALED(status)) return "was ended by signal " + std::to_string(WTERMSIG(status));
  return "ended with exit code " + std::to_string(WEXITSTATUS(status));
}

// In the new process, between fork and exec.
[[noreturn]] void become(char* const* arguments, int output, int log, pid_t parent) {
  prctl(PR_SET_PDEATHSIG, SIGKILL);
  if (getppid() != parent) _exit(1);  // it was gone before we asked
  setpgid(0, 0);
  sigset_t none;
  sigemptyset(&none);
  sigprocmask(SIG_SETMASK, &none, nullptr);
  signal(SIGTSTP, SIG_DFL);
  dup2(open("/dev/null", O_RDONLY | O_CLOEXEC), STDIN_FILENO);
  dup2(output >= 0 ? output : log, STDOUT_FILENO);
  dup2(log, STDERR_FILENO);
  execv(arguments[0], arguments);
  _exit(127);
}

}  // namespace

TemporaryDirectory::TemporaryDirectory() {
  std::string path = std::filesystem::temp_directory_path() / "search-and-track-XXXXXX";
  if (mkdtemp(path.data()) == nullptr) fail("cannot make " + path);
  path_ = path;
}

TemporaryDirectory::~TemporaryDirectory() {
  std::error_code ignored;
  std::filesystem::remove_all(path_, ignored);
}

Processes::Processes() {
  setenv("XDG_RUNTIME_DIR", directory_.path().c_str(), 1);
  setenv("ARBITER_INSTANCE", ("search-and-track-" + std::to_string(getpid())).c_str(), 1);
  unsetenv("RUNTIME_DIRECTORY");
  unsetenv("NOTIFY_SOCKET");
}

Processes::~Processes() {
  stop(components_);
  stop(daemon_);
}

void Processes::start_daemon(const std::filesystem::path& program,
                             const std::filesystem::path& model) {
  daemon_.push_back(spawn(program, {"--model", model.string()}, false));
  const auto give_up = Clock::now() + kTimeToStart;
  arbiter::NodeOptions patience;
  patience.connect_timeout = 100ms;
  patience.service_thread = false;
  for (;;) {
    try {
      const arbiter::Node probe("search-and-track-demo", patience);
      return;
    } catch (const arbiter::Error&) {
      check_all_run();
      if (Clock::now() >= give_up) throw;
    }
  }
}

std::size_t Processes::start_component(const std::filesystem::path& program,
                                       const std::vector<std::string>& arguments) {
  components_.push_back(spawn(program, arguments, true));
  return components_.size() - 1;
}

Processes::Child Processes::spawn(const std::filesystem::path& program,
                                  const std::vector<std::string>& arguments, bool heard) {
  std::vector<char*> argv{const_cast<char*>(program.c_str())};
  for (const std::string& argument : arguments) argv.push_back(const_cast<char*>(argument.c_str()));
  argv.push_back(nullptr);
  std::array<int, 2> ends{-1, -1};
  if (heard && pipe2(ends.data(), O_CLOEXEC) != 0) fail("no pipe for " + program.string());
  const int log =
      open((directory_.path() / "log").c_str(), O_WRONLY | O_CREAT | O_APPEND | O_CLOEXEC, 0600);
  const pid_t self = getpid();
  Child child{program.filename().string(), fork(), ends[0], ""};
  if (child.pid == 0) become(argv.data(), ends[1], log, self);
  const int fork_error = errno;
  // Here too, lest a Ctrl-C reach the child before it has come to do so itself.
  if (child.pid > 0) setpgid(child.pid, child.pid);
  for (const int descriptor : {ends[1], log}) {
    if (descriptor >= 0) close(descriptor);
  }
  if (child.pid < 0) {
    if (child.output >= 0) close(child.output);
    errno = fork_error;
    fail("cannot start " + program.string());
  }
  if (child.output >= 0) fcntl(child.output, F_SETFL, O_NONBLOCK);
  return child;
}

void Processes::listen(int wakeup, int timeout_ms, const OnLine& on_line) {
  std::vector<pollfd> polled{{wakeup, POLLIN, 0}};
  for (const Child& child : components_) polled.push_back({child.output, POLLIN, 0});
  if (poll(polled.data(), polled.size(), timeout_ms) <= 0) return;
  for (std::size_t i = 0; i < components_.size(); ++i) {
    if (polled[i + 1].revents == 0) continue;
    Child& child = components_[i];
    std::array<char, 4096> buffer{};
    const ssize_t count = read(child.output, buffer.data(), buffer.size());
    if (count == 0) {
      throw std::runtime_error(child.name + " ended before its time\n" + log());
    }
    if (count < 0) continue;
    child.unfinished_line.append(buffer.data(), static_cast<std::size_t>(count));
    std::size_t end = 0;
    while ((end = child.unfinished_line.find('\n')) != std::string::npos) {
      on_line(i, std::string_view(child.unfinished_line).substr(0, end));
      child.unfinished_line.erase(0, end + 1);
    }
  }
}

void Processes::check_all_run() {
  for (auto* const children : {&daemon_, &components_}) {
    for (Child& child : *children) {
      int status = 0;
      if (child.pid < 0 || waitpid(child.pid, &status, WNOHANG) != child.pid) continue;
      child.pid = -1;
      throw std::runtime_error(child.name + ' ' + how_it_ended(status) + "\n" + log());
    }
  }
}

// Politely, and if that is no use, not.
void Processes::stop(std::vector<Child>& children) noexcept {
  for (const Child& child : children) {
    if (child.pid > 0) kill(child.pid, SIGTERM);
  }
  const auto give_up = Clock::now() + kTimeToStop;
  for (Child& child : children) {
    while (child.pid > 0 && waitpid(child.pid, nullptr, WNOHANG) == 0) {
      if (Clock::now() >= give_up) kill(child.pid, SIGKILL);
      std::this_thread::sleep_for(2ms);
    }
    if (child.output >= 0) close(child.output);
  }
  children.clear();
}

std::string Processes::log() const {
  std::ostringstream text;
  text << std::ifstream(directory_.path() / "log").rdbuf();
  return text.str();
}

}  // namespace search_and_track
