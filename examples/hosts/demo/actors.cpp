#include "actors.hpp"

#include <fcntl.h>
#include <poll.h>
#include <signal.h>
#include <stdlib.h>
#include <sys/prctl.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cerrno>
#include <system_error>
#include <thread>

namespace hosts_demo {
namespace {

using namespace std::chrono_literals;

constexpr auto kTimeToStop = 2s;

// In the new process, between fork and exec.
[[noreturn]] void become(char* const* arguments, const char* instance, int output, pid_t parent) {
  prctl(PR_SET_PDEATHSIG, SIGKILL);
  if (getppid() != parent) _exit(1);
  setpgid(0, 0);
  sigset_t none;
  sigemptyset(&none);
  sigprocmask(SIG_SETMASK, &none, nullptr);
  setenv("ARBITER_INSTANCE", instance, 1);
  dup2(open("/dev/null", O_RDWR | O_CLOEXEC), STDIN_FILENO);
  dup2(output, STDOUT_FILENO);
  dup2(output, STDERR_FILENO);
  execv(arguments[0], arguments);
  _exit(127);
}

}  // namespace

Actors::Actors(std::array<std::vector<std::string>, kParts.size()> commands) {
  setenv("XDG_RUNTIME_DIR", directory_.path().c_str(), 1);
  unsetenv("RUNTIME_DIRECTORY");
  unsetenv("NOTIFY_SOCKET");
  unsetenv("CYCLONEDDS_URI");
  for (std::size_t part = 0; part < kParts.size(); ++part) {
    children_[part].command = std::move(commands[part]);
    start(children_[part], part);
  }
}

Actors::~Actors() {
  for (const Child& child : children_) {
    if (child.pid < 0) continue;
    kill(child.pid, SIGTERM);
    kill(child.pid, SIGCONT);  // it may be a link that was stopped
  }
  const auto give_up = Clock::now() + kTimeToStop;
  for (Child& child : children_) {
    while (child.pid > 0 && waitpid(child.pid, nullptr, WNOHANG) == 0) {
      if (Clock::now() >= give_up) kill(child.pid, SIGKILL);
      std::this_thread::sleep_for(2ms);
    }
    if (child.output >= 0) close(child.output);
  }
}

void Actors::start(Child& child, std::size_t part) const {
  std::vector<char*> arguments;
  for (std::string& each : child.command) arguments.push_back(each.data());
  arguments.push_back(nullptr);
  std::array<int, 2> ends{-1, -1};
  if (pipe2(ends.data(), O_CLOEXEC) != 0) {
    throw std::system_error(errno, std::generic_category(), "no pipe");
  }
  const pid_t self = getpid();
  child.pid = fork();
  if (child.pid == 0) become(arguments.data(), kHostNames[kParts[part].host], ends[1], self);
  const int error = errno;
  close(ends[1]);
  if (child.pid < 0) {
    close(ends[0]);
    throw std::system_error(error, std::generic_category(), "no process");
  }
  setpgid(child.pid, child.pid);
  fcntl(ends[0], F_SETFL, O_NONBLOCK);
  child.output = ends[0];
  child.unfinished_line.clear();
}

void Actors::signal(std::size_t part, int number) const {
  if (children_[part].pid > 0) kill(children_[part].pid, number);
}

void Actors::note_end(Child& child) {
  while (waitpid(child.pid, nullptr, 0) < 0 && errno == EINTR) {
  }
  close(child.output);
  child.pid = child.output = -1;
  child.died = Clock::now();
}

void Actors::listen(int wakeup, int timeout_ms, std::chrono::milliseconds pause,
                    const OnLine& on_line) {
  std::vector<pollfd> polled{{wakeup, POLLIN, 0}};
  // What is dead is passed over: a descriptor of -1.
  for (const Child& child : children_) polled.push_back({child.output, POLLIN, 0});
  if (poll(polled.data(), polled.size(), timeout_ms) > 0) {
    for (std::size_t part = 0; part < children_.size(); ++part) {
      if (polled[part + 1].revents != 0) read_from(part, on_line);
    }
  }
  for (std::size_t part = 0; part < children_.size(); ++part) {
    Child& child = children_[part];
    const bool is_due = child.pid < 0 && !child.stays_dead && Clock::now() >= child.died + pause;
    if (is_due) start(child, part);
  }
}

void Actors::read_from(std::size_t part, const OnLine& on_line) {
  Child& child = children_[part];
  std::array<char, 4096> buffer{};
  const ssize_t count = read(child.output, buffer.data(), buffer.size());
  if (count < 0) return;
  if (count == 0) {
    note_end(child);
    return;
  }
  child.unfinished_line.append(buffer.data(), static_cast<std::size_t>(count));
  std::size_t end = 0;
  while ((end = child.unfinished_line.find('\n')) != std::string::npos) {
    on_line(part, std::string_view(child.unfinished_line).substr(0, end));
    child.unfinished_line.erase(0, end + 1);
  }
}

}  // namespace hosts_demo
