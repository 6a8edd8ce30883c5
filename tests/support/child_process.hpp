// A program that runs beside the test: started with an environment of its own, spoken to, ended.
#pragma once

#include <fcntl.h>
#include <poll.h>
#include <signal.h>
#include <sys/prctl.h>
#include <sys/syscall.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cerrno>
#include <cstdlib>
#include <map>
#include <optional>
#include <stdexcept>
#include <string>
#include <system_error>
#include <utility>
#include <vector>

#include "shm/file_descriptor.hpp"

namespace arbiter::test {

// Changes to the environment that a program is started in; nullopt: not set.
using Environment = std::map<std::string, std::optional<std::string>>;

class ChildProcess {
 public:
  struct Streams {
    int in = -1;  // -1: /dev/null
    int out = -1;
    int err = -1;  // -1: as the test's
  };

  ChildProcess() = default;
  // The program ends with the test, however that ends.
  ChildProcess(const std::vector<std::string>& argv, const Environment& changes,
               const Streams& streams) {
    std::vector<std::string> variables = environment(changes);
    std::vector<char*> arguments = pointers(argv);
    std::vector<char*> values = pointers(variables);
    shm::FileDescriptor null(::open("/dev/null", O_RDWR | O_CLOEXEC));
    const pid_t parent = ::getpid();
    pid_ = ::fork();
    if (pid_ < 0) throw std::system_error(errno, std::generic_category(), "fork");
    if (pid_ == 0) {
      ::prctl(PR_SET_PDEATHSIG, SIGKILL);
      const pid_t starter = ::getppid();  // 0 from within a PID namespace of its own
      if (starter != 0 && starter != parent) ::_exit(126);
      ::dup2(streams.in < 0 ? null.get() : streams.in, STDIN_FILENO);
      ::dup2(streams.out < 0 ? null.get() : streams.out, STDOUT_FILENO);
      if (streams.err >= 0) ::dup2(streams.err, STDERR_FILENO);
      ::execve(arguments[0], arguments.data(), values.data());
      ::_exit(127);
    }
    process_.reset(static_cast<int>(::syscall(SYS_pidfd_open, pid_, 0)));
    if (!process_) throw std::system_error(errno, std::generic_category(), "pidfd_open");
  }
  ChildProcess(ChildProcess&& other) noexcept
      : pid_(std::exchange(other.pid_, -1)), process_(std::move(other.process_)) {}
  ChildProcess& operator=(ChildProcess&& other) noexcept {
    if (this != &other) {
      end();
      pid_ = std::exchange(other.pid_, -1);
      process_ = std::move(other.process_);
    }
    return *this;
  }
  ~ChildProcess() { end(); }

  [[nodiscard]] pid_t pid() const { return pid_; }
  // Readable once it has ended.
  [[nodiscard]] int descriptor() const { return process_.get(); }
  [[nodiscard]] bool runs() const { return pid_ > 0; }
  void signal(int number) const { ::kill(pid_, number); }
  // Waits for its end; 128 and the signal's number if a signal ended it.
  int wait() {
    int status = 0;
    while (::waitpid(pid_, &status, 0) < 0 && errno == EINTR) {
    }
    pid_ = -1;
    return WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status);
  }
  // Stops it, and returns when it does not run any more.
  void stop() const {
    signal(SIGSTOP);
    int status = 0;
    while (::waitpid(pid_, &status, WUNTRACED) < 0 && errno == EINTR) {
    }
  }
  void resume() const { signal(SIGCONT); }
  void kill() {
    if (!runs()) return;
    signal(SIGKILL);
    wait();
  }

 private:
  void end() noexcept { kill(); }

  static std::vector<std::string> environment(const Environment& changes) {
    std::vector<std::string> result;
    for (char** entry = ::environ; *entry != nullptr; ++entry) {
      const std::string variable(*entry);
      if (changes.count(variable.substr(0, variable.find('='))) == 0) result.push_back(variable);
    }
    for (const auto& [name, value] : changes) {
      if (value) result.push_back(name + "=" + *value);
    }
    return result;
  }
  static std::vector<char*> pointers(const std::vector<std::string>& strings) {
    std::vector<char*> result;
    for (const std::string& each : strings) result.push_back(const_cast<char*>(each.c_str()));
    result.push_back(nullptr);
    return result;
  }

  pid_t pid_ = -1;
  shm::FileDescriptor process_;
};

}  // namespace arbiter::test
