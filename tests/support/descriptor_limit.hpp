// How many descriptors this process may have, for a while.
#pragma once

#include <fcntl.h>
#include <sys/resource.h>
#include <unistd.h>

#include <stdexcept>

#include "shm/file_descriptor.hpp"

namespace arbiter::test {

// While it lives, this process gets none of that number or beyond.
class DescriptorLimit {
 public:
  explicit DescriptorLimit(rlim_t beyond) {
    if (::getrlimit(RLIMIT_NOFILE, &before_) != 0) throw std::runtime_error("getrlimit");
    const rlimit limit{beyond, before_.rlim_max};
    if (::setrlimit(RLIMIT_NOFILE, &limit) != 0) throw std::runtime_error("setrlimit");
  }
  DescriptorLimit(const DescriptorLimit&) = delete;
  DescriptorLimit& operator=(const DescriptorLimit&) = delete;
  ~DescriptorLimit() { ::setrlimit(RLIMIT_NOFILE, &before_); }

 private:
  rlimit before_{};
};

// While it lives, this process gets no further descriptor.
class NoDescriptors {
 private:
  static rlim_t next() {
    return static_cast<rlim_t>(
        shm::FileDescriptor(::fcntl(STDERR_FILENO, F_DUPFD_CLOEXEC, 0)).get());
  }
  const DescriptorLimit limit_{next()};
};

}  // namespace arbiter::test
