// A program that runs beside the test, and is spoken to by lines.
#pragma once

#include <fcntl.h>
#include <poll.h>
#include <unistd.h>

#include <optional>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "shm/file_descriptor.hpp"
#include "tests/support/child_process.hpp"

namespace arbiter::test {

// A program whose output is read line by line.
class Spoken {
 public:
  Spoken() = default;
  explicit Spoken(std::vector<std::string> argv) {
    int in[2];
    int out[2];
    if (::pipe2(in, O_CLOEXEC) != 0 || ::pipe2(out, O_CLOEXEC) != 0)
      throw std::runtime_error("pipe");
    in_.reset(in[1]);
    out_.reset(out[0]);
    const shm::FileDescriptor their_in(in[0]);
    const shm::FileDescriptor their_out(out[1]);
    process = ChildProcess(argv, {}, {their_in.get(), their_out.get(), their_out.get()});
  }

  // The next line; nothing: it has ended, or says nothing for half a minute.
  std::optional<std::string> line() {
    for (;;) {
      if (const auto end = read_.find('\n'); end != std::string::npos) {
        std::string result = read_.substr(0, end);
        read_.erase(0, end + 1);
        return result;
      }
      pollfd polled{out_.get(), POLLIN, 0};
      if (::poll(&polled, 1, 30'000) <= 0) return {};
      char bytes[4096];
      const ssize_t count = ::read(out_.get(), bytes, sizeof bytes);
      if (count <= 0) return {};
      read_.append(bytes, static_cast<std::size_t>(count));
    }
  }
  // Reads until a line contains `text`; false: none does.
  bool hear(const std::string& text) {
    for (;;) {
      const auto next = line();
      if (!next) return false;
      if (next->find(text) != std::string::npos) return true;
      heard += *next + "\n";
    }
  }
  void say(const std::string& text) const {
    const std::string with_end = text + "\n";
    static_cast<void>(!::write(in_.get(), with_end.data(), with_end.size()));
  }

  ChildProcess process;
  std::string heard;  // lines that were passed over

 private:
  shm::FileDescriptor in_;
  shm::FileDescriptor out_;
  std::string read_;
};

}  // namespace arbiter::test
