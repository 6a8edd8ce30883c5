#include "tests/kill/points.hpp"

#include <poll.h>
#include <signal.h>
#include <sys/mman.h>
#include <sys/socket.h>
#include <sys/types.h>
#include <unistd.h>

#include <atomic>

namespace arbiter::kill {
namespace {

std::atomic<std::uint64_t> passed{0};
std::atomic<std::uint64_t> fatal_point{UINT64_MAX};
std::atomic<bool> all_armed{false};
thread_local bool this_armed = false;

void arm(std::uint64_t fatal) noexcept {
  passed = 0;
  fatal_point = fatal;
}

}  // namespace

void arm_this_thread(std::uint64_t fatal) noexcept {
  arm(fatal);
  this_armed = true;
}

void arm_all_threads(std::uint64_t fatal) noexcept {
  arm(fatal);
  all_armed = true;
}

std::uint64_t disarm() noexcept {
  this_armed = false;
  all_armed = false;
  return passed;
}

void pass_point() noexcept {
  if (!this_armed && !all_armed.load(std::memory_order_relaxed)) return;
  if (passed.fetch_add(1) == fatal_point.load(std::memory_order_relaxed)) {
    ::kill(::getpid(), SIGKILL);
  }
}

}  // namespace arbiter::kill

// The linker leads our objects' system calls here (--wrap).
using arbiter::kill::pass_point;

extern "C" {

ssize_t __real_write(int fd, const void* data, size_t size);
ssize_t __wrap_write(int fd, const void* data, size_t size) {
  pass_point();
  return __real_write(fd, data, size);
}

ssize_t __real_read(int fd, void* data, size_t size);
ssize_t __wrap_read(int fd, void* data, size_t size) {
  pass_point();
  return __real_read(fd, data, size);
}

ssize_t __real_sendmsg(int socket, const msghdr* message, int flags);
ssize_t __wrap_sendmsg(int socket, const msghdr* message, int flags) {
  pass_point();
  return __real_sendmsg(socket, message, flags);
}

ssize_t __real_recvmsg(int socket, msghdr* message, int flags);
ssize_t __wrap_recvmsg(int socket, msghdr* message, int flags) {
  pass_point();
  return __real_recvmsg(socket, message, flags);
}

int __real_connect(int socket, const sockaddr* address, socklen_t size);
int __wrap_connect(int socket, const sockaddr* address, socklen_t size) {
  pass_point();
  return __real_connect(socket, address, size);
}

void* __real_mmap(void* address, size_t size, int protection, int flags, int fd, off_t at);
void* __wrap_mmap(void* address, size_t size, int protection, int flags, int fd, off_t at) {
  pass_point();
  return __real_mmap(address, size, protection, flags, fd, at);
}

int __real_munmap(void* address, size_t size);
int __wrap_munmap(void* address, size_t size) {
  pass_point();
  return __real_munmap(address, size);
}

int __real_fallocate(int fd, int mode, off_t at, off_t size);
int __wrap_fallocate(int fd, int mode, off_t at, off_t size) {
  pass_point();
  return __real_fallocate(fd, mode, at, size);
}

int __real_memfd_create(const char* name, unsigned flags);
int __wrap_memfd_create(const char* name, unsigned flags) {
  pass_point();
  return __real_memfd_create(name, flags);
}

int __real_close(int fd);
int __wrap_close(int fd) {
  pass_point();
  return __real_close(fd);
}

int __real_ppoll(pollfd* fds, nfds_t count, const timespec* timeout, const sigset_t* mask);
int __wrap_ppoll(pollfd* fds, nfds_t count, const timespec* timeout, const sigset_t* mask) {
  pass_point();
  return __real_ppoll(fds, count, timeout, mask);
}
}
