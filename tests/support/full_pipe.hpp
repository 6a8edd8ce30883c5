// A standard error that nobody reads: `| less`, a collector that is stopped.
#pragma once

#include <fcntl.h>
#include <unistd.h>

#include <stdexcept>
#include <string>

#include "shm/file_descriptor.hpp"

namespace arbiter::test {

// A pipe as full as it can be: a write() waits until somebody reads.
class FullPipe {
 public:
  FullPipe() {
    int ends[2];
    if (::pipe2(ends, O_CLOEXEC | O_NONBLOCK) != 0) throw std::runtime_error("no pipe");
    read_end_.reset(ends[0]);
    write_end_.reset(ends[1]);
    for (const std::string& bytes : {std::string(4096, 'x'), std::string("x")}) {
      while (::write(write_end_.get(), bytes.data(), bytes.size()) > 0) {
      }
    }
    for (const int end : ends) {
      if (::fcntl(end, F_SETFL, 0) != 0) throw std::runtime_error("fcntl");
    }
  }
  [[nodiscard]] int write_end() const { return write_end_.get(); }
  // Reads what is in it until `text` has come; false: it has not, and nobody can write any more.
  [[nodiscard]] bool read_until(const std::string& text) {
    write_end_.reset();
    std::string read;
    while (read.find(text) == std::string::npos) {
      char buffer[4096];
      const ssize_t size = ::read(read_end_.get(), buffer, sizeof buffer);
      if (size <= 0) return false;
      read.append(buffer, static_cast<std::size_t>(size));
    }
    return true;
  }

 private:
  shm::FileDescriptor read_end_;
  shm::FileDescriptor write_end_;
};

}  // namespace arbiter::test
