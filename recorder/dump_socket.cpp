#include "recorder/dump_socket.hpp"

#include <fcntl.h>
#include <sys/file.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/time.h>
#include <sys/un.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <stdexcept>
#include <utility>

#include "recorder/sleep.hpp"
#include "shm/clock.hpp"

namespace arbiter::recorder {
namespace {

// More who ask at once wait their turn.
constexpr std::size_t kMostAsking = 16;

sockaddr_un address_of(const std::string& path) {
  sockaddr_un address{};
  address.sun_family = AF_UNIX;
  if (path.size() >= sizeof address.sun_path) {
    throw std::runtime_error(path + " is too long for the name of a socket: choose a shorter -o");
  }
  std::memcpy(address.sun_path, path.c_str(), path.size() + 1);
  return address;
}

[[noreturn]] void give_up(const std::string& prefix) {
  throw std::runtime_error("the flight recorder that writes to " + prefix +
                           " has not answered in time: it is stopped, or its disk is slow. The "
                           "file may still come; --timeout waits longer");
}

[[noreturn]] void say_that_none_writes(const std::string& prefix) {
  throw std::runtime_error("no flight recorder writes to " + prefix +
                           "; start one with: arbiter record --ring 5min -o " + prefix);
}

// The socket is its user's alone, and so may be the directory.
[[noreturn]] void say_who_may_ask(const std::string& prefix) {
  throw std::runtime_error(
      "permission denied: only the user who has started the flight recorder "
      "that writes to " +
      prefix + " may ask it; run this as that user, or as root");
}

// A recorder that is stopped lets only so many stand at its door: then connecting waits, too.
shm::FileDescriptor connected_to(const std::string& prefix, shm::Nanoseconds end) {
  const sockaddr_un address = address_of(prefix + ".sock");
  shm::FileDescriptor socket(::socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0));
  const shm::Nanoseconds left = std::max<shm::Nanoseconds>(end - shm::monotonic_now(), 1'000);
  if (end != shm::kForever) {
    const timeval span{left / 1'000'000'000, left % 1'000'000'000 / 1'000};
    ::setsockopt(socket.get(), SOL_SOCKET, SO_SNDTIMEO, &span, sizeof span);
  }
  while (::connect(socket.get(), reinterpret_cast<const sockaddr*>(&address), sizeof address) !=
         0) {
    if (errno == EINTR) continue;
    if (errno == EAGAIN) give_up(prefix);
    if (errno == EACCES || errno == EPERM) say_who_may_ask(prefix);
    say_that_none_writes(prefix);
  }
  return socket;
}

// The socket itself says nothing: one that was left behind by a recorder that was killed is there
// too, and to connect is to ask.
shm::FileDescriptor lock(const std::string& prefix) {
  const std::string path = prefix + ".lock";
  shm::FileDescriptor file(::open(path.c_str(), O_RDWR | O_CREAT | O_CLOEXEC | O_NOFOLLOW, 0600));
  if (!file) {
    throw std::runtime_error("cannot open " + path + ": " + std::strerror(errno));
  }
  if (::flock(file.get(), LOCK_EX | LOCK_NB) != 0) {
    throw std::runtime_error("another flight recorder writes to " + prefix +
                             "; give another -o, or ask that one: arbiter record --dump -o " +
                             prefix);
  }
  return file;
}

}  // namespace

DumpSocket::DumpSocket(const std::string& prefix) : path_(prefix + ".sock"), lock_(lock(prefix)) {
  const sockaddr_un address = address_of(path_);
  struct stat there {};
  if (::lstat(path_.c_str(), &there) == 0 && S_ISSOCK(there.st_mode)) ::unlink(path_.c_str());
  listener_ = shm::FileDescriptor(::socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0));
  const mode_t before = ::umask(0177);
  const bool is_bound =
      ::bind(listener_.get(), reinterpret_cast<const sockaddr*>(&address), sizeof address) == 0;
  const int error = errno;
  ::umask(before);
  if (!is_bound || ::listen(listener_.get(), 4) != 0) {
    throw std::runtime_error("cannot listen at " + path_ + ": " +
                             std::strerror(is_bound ? errno : error));
  }
}

DumpSocket::~DumpSocket() { ::unlink(path_.c_str()); }

void DumpSocket::accept(const std::function<std::uint64_t()>& request) {
  while (asking_.size() < kMostAsking) {
    shm::FileDescriptor one(
        ::accept4(listener_.get(), nullptr, nullptr, SOCK_CLOEXEC | SOCK_NONBLOCK));
    if (!one) return;
    asking_.push_back({request(), std::move(one)});
  }
}

// One who has gone, or does not read, has no answer.
void DumpSocket::answer(std::uint64_t request, const std::string& line) {
  std::erase_if(asking_, [&](const Asking& one) {
    if (one.request != request) return false;
    static_cast<void>(
        ::send(one.socket.get(), line.data(), line.size(), MSG_NOSIGNAL | MSG_DONTWAIT));
    return true;
  });
}

std::string ask_for_dump(const std::string& prefix, shm::Nanoseconds patience) {
  const shm::Nanoseconds now = shm::monotonic_now();
  const shm::Nanoseconds end = patience >= shm::kForever - now ? shm::kForever : now + patience;
  const auto socket = connected_to(prefix, end);
  std::string answer;
  char buffer[512];
  for (;;) {
    if (!sleep_until(end, {socket.get()})) give_up(prefix);
    const ssize_t size = ::read(socket.get(), buffer, sizeof buffer);
    if (size < 0 && errno == EINTR) continue;
    if (size <= 0) break;
    answer.append(buffer, static_cast<std::size_t>(size));
  }
  if (answer.empty()) throw std::runtime_error("the flight recorder has ended without an answer");
  return answer;
}

}  // namespace arbiter::recorder
