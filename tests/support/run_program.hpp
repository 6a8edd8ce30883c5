// Runs a program to its end and tells what it wrote.
#pragma once

#include <fcntl.h>
#include <poll.h>
#include <signal.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <cstdlib>
#include <stdexcept>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace arbiter::test {

struct ProgramResult {
  int exit_code = -1;  // 128 and the signal's number if a signal ended it
  std::string out;
  std::string err;
};

namespace program_detail {

struct Pipe {
  Pipe() {
    if (::pipe2(ends.data(), O_CLOEXEC) != 0) throw std::runtime_error("pipe2");
  }
  ~Pipe() {
    close(0);
    close(1);
  }
  Pipe(const Pipe&) = delete;
  Pipe& operator=(const Pipe&) = delete;
  void close(std::size_t end) {
    if (ends[end] >= 0) ::close(ends[end]);
    ends[end] = -1;
  }
  std::array<int, 2> ends{-1, -1};
};

// One step of the exchange; false once there is nothing left to read.
inline bool exchange(Pipe& in, std::string_view& input,
                     const std::array<std::pair<Pipe*, std::string*>, 2>& outputs) {
  std::array<pollfd, 3> polled{{{in.ends[1], POLLOUT, 0},
                                {outputs[0].first->ends[0], POLLIN, 0},
                                {outputs[1].first->ends[0], POLLIN, 0}}};
  if (polled[1].fd < 0 && polled[2].fd < 0) return false;
  if (::poll(polled.data(), polled.size(), -1) < 0 && errno != EINTR) return false;
  if (polled[0].revents != 0) {
    const ssize_t count = ::write(in.ends[1], input.data(), input.size());
    if (count > 0) input.remove_prefix(static_cast<std::size_t>(count));
    if (count <= 0 || input.empty()) in.close(1);
  }
  for (std::size_t i = 0; i < 2; ++i) {
    if (polled[i + 1].revents == 0) continue;
    std::array<char, 65536> buffer;
    const ssize_t count = ::read(polled[i + 1].fd, buffer.data(), buffer.size());
    if (count > 0) {
      outputs[i].second->append(buffer.data(), static_cast<std::size_t>(count));
    } else {
      outputs[i].first->close(0);
    }
  }
  return true;
}

}  // namespace program_detail

// argv[0] is the program's path. `out_path`, if given, is opened as its standard output instead.
inline ProgramResult run_program(const std::vector<std::string>& argv, std::string_view input = {},
                                 const char* out_path = nullptr) {
  using program_detail::Pipe;
  std::vector<char*> arguments;
  for (const auto& argument : argv) arguments.push_back(const_cast<char*>(argument.c_str()));
  arguments.push_back(nullptr);
  Pipe in, out, err;
  const pid_t child = ::fork();
  if (child < 0) throw std::runtime_error("fork");
  if (child == 0) {
    const int out_fd = out_path != nullptr ? ::open(out_path, O_WRONLY | O_CLOEXEC) : out.ends[1];
    ::dup2(in.ends[0], STDIN_FILENO);
    ::dup2(out_fd, STDOUT_FILENO);
    ::dup2(err.ends[1], STDERR_FILENO);
    ::execv(arguments[0], arguments.data());
    ::_exit(127);
  }
  in.close(0);
  out.close(1);
  err.close(1);
  if (input.empty()) in.close(1);
  // A program that does not read its input must not end the test.
  const auto old_handler = ::signal(SIGPIPE, SIG_IGN);
  ProgramResult result;
  while (program_detail::exchange(in, input, {{{&out, &result.out}, {&err, &result.err}}})) {
  }
  int status = 0;
  while (::waitpid(child, &status, 0) < 0 && errno == EINTR) {
  }
  ::signal(SIGPIPE, old_handler);
  result.exit_code = WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status);
  return result;
}

}  // namespace arbiter::test
