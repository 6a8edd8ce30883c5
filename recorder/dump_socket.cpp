#include "recorder/dump_socket.hpp"

#include <fcntl.h>
#include <sys/file.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/un.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <stdexcept>

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

shm::FileDescriptor make_socket() {
  return shm::FileDescriptor(::socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0));
}

bool connect_to(const shm::FileDescriptor& socket, const sockaddr_un& address) {
  return ::connect(socket.get(), reinterpret_cast<const sockaddr*>(&address), sizeof address) == 0;
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
    throw std::runtime_error("another flight recorder writes to " + prefix);
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

bool DumpSocket::accept() {
  bool has_come = false;
  while (asking_.size() < kMostAsking) {
    shm::FileDescriptor one(
        ::accept4(listener_.get(), nullptr, nullptr, SOCK_CLOEXEC | SOCK_NONBLOCK));
    if (!one) break;
    asking_.push_back(std::move(one));
    has_come = true;
  }
  return has_come;
}

// One who has gone, or does not read, has no answer.
void DumpSocket::answer(const std::string& line) {
  for (const auto& one : asking_) {
    static_cast<void>(::send(one.get(), line.data(), line.size(), MSG_NOSIGNAL | MSG_DONTWAIT));
  }
  asking_.clear();
}

std::string ask_for_dump(const std::string& prefix) {
  const auto socket = make_socket();
  if (!connect_to(socket, address_of(prefix + ".sock"))) {
    throw std::runtime_error("no flight recorder writes to " + prefix +
                             "; start one with: arbiter record --ring 5min -o " + prefix);
  }
  std::string answer;
  char buffer[512];
  for (;;) {
    const ssize_t size = ::read(socket.get(), buffer, sizeof buffer);
    if (size < 0 && errno == EINTR) continue;
    if (size <= 0) break;
    answer.append(buffer, static_cast<std::size_t>(size));
  }
  if (answer.empty()) throw std::runtime_error("the flight recorder has ended without an answer");
  return answer;
}

}  // namespace arbiter::recorder
