// An owned file descriptor.
#pragma once

#include <fcntl.h>
#include <unistd.h>

#include <atomic>
#include <cstddef>
#include <cstdint>
#include <utility>

namespace arbiter::shm {

// Which descriptors a child process closes (shm/descendants.hpp). A bit for each, so that the child
// can go through them without a lock or memory of its own; those above the range are left open.
class MarkedDescriptors {
 public:
  static void mark(int fd) noexcept {
    if (is_in_range(fd)) word_of(fd).fetch_or(bit_of(fd), std::memory_order_relaxed);
  }
  static void forget(int fd) noexcept {
    if (!is_in_range(fd)) return;
    if ((word_of(fd).load(std::memory_order_relaxed) & bit_of(fd)) == 0) return;
    word_of(fd).fetch_and(~bit_of(fd), std::memory_order_relaxed);
  }
  static void close_all() noexcept {
    for (std::size_t i = 0; i < kWords; ++i) {
      for (std::uint64_t word = words[i].exchange(0, std::memory_order_relaxed); word != 0;
           word &= word - 1) {
        ::close(static_cast<int>(i * 64) + __builtin_ctzll(word));
      }
    }
  }

 private:
  static constexpr std::size_t kWords = 1024;

  static bool is_in_range(int fd) noexcept {
    return fd >= 0 && static_cast<std::size_t>(fd) < kWords * 64;
  }
  static std::atomic<std::uint64_t>& word_of(int fd) noexcept {
    return words[static_cast<std::size_t>(fd) / 64];
  }
  static std::uint64_t bit_of(int fd) noexcept { return std::uint64_t{1} << (fd % 64); }

  inline static std::atomic<std::uint64_t> words[kWords];
};

class FileDescriptor {
 public:
  FileDescriptor() = default;
  explicit FileDescriptor(int fd) noexcept : fd_(fd) {}
  FileDescriptor(FileDescriptor&& other) noexcept : fd_(std::exchange(other.fd_, -1)) {}
  FileDescriptor& operator=(FileDescriptor&& other) noexcept {
    if (this != &other) {
      reset();
      fd_ = std::exchange(other.fd_, -1);
    }
    return *this;
  }
  ~FileDescriptor() { reset(); }

  [[nodiscard]] int get() const noexcept { return fd_; }
  explicit operator bool() const noexcept { return fd_ >= 0; }
  [[nodiscard]] int release() noexcept {
    MarkedDescriptors::forget(fd_);
    return std::exchange(fd_, -1);
  }
  void reset(int fd = -1) noexcept {
    if (fd_ >= 0) {
      MarkedDescriptors::forget(fd_);
      ::close(fd_);
    }
    fd_ = fd;
  }

 private:
  int fd_ = -1;
};

// Another descriptor of what `fd` is one of. Empty, with errno: there is none left.
[[nodiscard]] inline FileDescriptor duplicate(int fd) noexcept {
  return FileDescriptor(::fcntl(fd, F_DUPFD_CLOEXEC, 0));
}

}  // namespace arbiter::shm
