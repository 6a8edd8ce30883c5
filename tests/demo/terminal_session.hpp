// A program that runs in a terminal of its own.
#pragma once

#include <pty.h>
#include <signal.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <functional>
#include <stdexcept>
#include <string>
#include <vector>

#include "tests/demo/screen.hpp"

namespace arbiter::test {

class TerminalSession {
 public:
  TerminalSession(const std::vector<std::string>& argv, int rows, int columns)
      : screen_(rows, columns) {
    std::vector<char*> arguments;
    for (const auto& argument : argv) arguments.push_back(const_cast<char*>(argument.c_str()));
    arguments.push_back(nullptr);
    winsize size{};
    size.ws_row = static_cast<unsigned short>(rows);
    size.ws_col = static_cast<unsigned short>(columns);
    child_ = ::forkpty(&terminal_, nullptr, nullptr, &size);
    if (child_ < 0) throw std::runtime_error("forkpty");
    if (child_ == 0) {
      ::setenv("TERM", "xterm", 1);
      ::execv(arguments[0], arguments.data());
      ::_exit(127);
    }
  }
  ~TerminalSession() {
    if (child_ > 0) ::kill(child_, SIGKILL);
    wait();
    ::close(terminal_);
  }
  TerminalSession(const TerminalSession&) = delete;
  TerminalSession& operator=(const TerminalSession&) = delete;

  [[nodiscard]] const Screen& screen() const { return screen_; }
  // All that it wrote, escape sequences included.
  [[nodiscard]] const std::string& written() const { return written_; }
  // Types these keys.
  void type(std::string_view keys) const {
    if (::write(terminal_, keys.data(), keys.size()) < 0) throw std::runtime_error("write");
  }

  void send(int signal) const { ::kill(child_, signal); }

  // Shows the program's output until the predicate holds, true, or the program has ended.
  bool watch_until(const std::function<bool()>& predicate) {
    std::array<char, 16384> buffer;
    for (;;) {
      const ssize_t count = ::read(terminal_, buffer.data(), buffer.size());
      if (count < 0 && errno == EINTR) continue;
      if (count <= 0) return false;
      const std::string_view text(buffer.data(), static_cast<std::size_t>(count));
      written_ += text;
      screen_.write(text);
      if (predicate()) return true;
    }
  }
  // 128 and the signal's number if a signal ended it.
  int watch_to_the_end() {
    watch_until([] { return false; });
    return wait();
  }

 private:
  int wait() {
    int status = 0;
    if (child_ <= 0) return -1;
    while (::waitpid(child_, &status, 0) < 0 && errno == EINTR) {
    }
    child_ = -1;
    return WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status);
  }

  Screen screen_;
  std::string written_;
  int terminal_ = -1;
  pid_t child_ = -1;
};

}  // namespace arbiter::test
