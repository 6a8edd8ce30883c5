#include "tests/fuzz/daemon/loop.hpp"

#include <fcntl.h>
#include <signal.h>
#include <sys/signalfd.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <time.h>
#include <unistd.h>

#include <algorithm>
#include <map>
#include <string>

#include "tests/fuzz/fuzz.hpp"

extern "C" {
int __real_accept4(int socket, sockaddr* address, socklen_t* size, int flags);
int __real_clock_gettime(clockid_t clock, timespec* time);
int __real_epoll_wait(int epoll, epoll_event* events, int most, int timeout_ms);
int __real_getsockopt(int socket, int level, int option, void* value, socklen_t* size);
}

namespace arbiter::fuzz {
namespace {

constexpr int kPeerProcess = 77;  // SO_PEERPIDFD
// No input of the largest size gives the daemon so much to do.
constexpr int kMostRounds = 100'000;

// Who is at the other end of the sockets that the daemon has accepted. One that it has closed
// stands here until it accepts another of that number.
std::map<int, Identity> peers;

// By inode.
std::map<ino_t, uid_t> makers;

}  // namespace

void Loop::declare_maker(int fd, uid_t user) {
  struct stat status {};
  if (::fstat(fd, &status) == 0) makers.emplace(status.st_ino, user);
}

void Loop::forget_maker(int fd) {
  struct stat status {};
  if (::fstat(fd, &status) == 0) makers.erase(status.st_ino);
}

uid_t maker_of(int fd) {
  struct stat status {};
  require(::fstat(fd, &status) == 0, "the daemon looks at memory and pipes alone");
  const auto declared = makers.find(status.st_ino);
  return declared == makers.end() ? status.st_uid : declared->second;
}

Loop::Loop() {
  makers.clear();
  int ends[2];
  require(::pipe2(ends, O_CLOEXEC | O_NONBLOCK) == 0, "a pipe can be made");
  read_end_.reset(ends[0]);
  write_end_.reset(ends[1]);
  current = this;
}

void Loop::tell_to_return() const {
  signalfd_siginfo info{};
  info.ssi_signo = SIGTERM;
  was_told_to_return = ::write(write_end_.get(), &info, sizeof info) == sizeof info;
  require(was_told_to_return, "the loop can be told to return");
}

int wait_for_events(int epoll, epoll_event* events, int most, int timeout_ms) {
  require(++Loop::rounds < kMostRounds, "the daemon rests when it has nothing to do");
  const int count = __real_epoll_wait(epoll, events, most, 0);
  Loop::heard += std::max(count, 0);
  if (count != 0 || timeout_ms == 0) return count;
  const shm::Nanoseconds timeout =
      timeout_ms < 0 ? shm::kForever : shm::Nanoseconds{timeout_ms} * 1'000'000;
  const shm::Nanoseconds passed = std::min(timeout, Loop::may_pass);
  Loop::may_pass -= passed;
  Loop::now += passed;
  if (passed == timeout) return 0;
  Loop::current->tell_to_return();
  return __real_epoll_wait(epoll, events, most, 0);
}

}  // namespace arbiter::fuzz

using arbiter::fuzz::Loop;

extern "C" uid_t __wrap__ZN7arbiter3shm8maker_ofEi(int fd) { return arbiter::fuzz::maker_of(fd); }

extern "C" int __wrap_accept4(int socket, sockaddr* address, socklen_t* size, int flags) {
  const int accepted = __real_accept4(socket, address, size, flags);
  if (accepted >= 0) arbiter::fuzz::peers[accepted] = Loop::connecting;
  return accepted;
}

extern "C" int __wrap_clock_gettime(clockid_t clock, timespec* time) {
  if (clock != CLOCK_MONOTONIC) return __real_clock_gettime(clock, time);
  *time = {Loop::now / 1'000'000'000, Loop::now % 1'000'000'000};
  return 0;
}

extern "C" int __wrap_epoll_wait(int epoll, epoll_event* events, int most, int timeout_ms) {
  return arbiter::fuzz::wait_for_events(epoll, events, most, timeout_ms);
}

extern "C" int __wrap_getsockopt(int socket, int level, int option, void* value, socklen_t* size) {
  const auto peer = arbiter::fuzz::peers.find(socket);
  if (peer == arbiter::fuzz::peers.end() || level != SOL_SOCKET) {
    return __real_getsockopt(socket, level, option, value, size);
  }
  if (option == SO_PEERCRED) {
    *static_cast<ucred*>(value) = {peer->second.pid, peer->second.user, peer->second.user};
    return 0;
  }
  if (option == arbiter::fuzz::kPeerProcess) {
    // Opened anew, as the kernel does: closing it ends what epoll has to say of it.
    const std::string path = "/proc/self/fd/" + std::to_string(peer->second.process);
    *static_cast<int*>(value) = ::open(path.c_str(), O_RDONLY | O_NONBLOCK | O_CLOEXEC);
    return 0;
  }
  return __real_getsockopt(socket, level, option, value, size);
}
