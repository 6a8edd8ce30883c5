#include "cli/listen.hpp"

#include <arpa/inet.h>
#include <netdb.h>
#include <netinet/in.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/un.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <memory>
#include <system_error>

#include <CLI/CLI.hpp>
#include <arbiter/arbiter.hpp>

namespace arbiter::cli {
namespace {

// As many may connect at once without having to try again.
constexpr int kBacklog = 1024;

using Addresses = std::unique_ptr<addrinfo, decltype(&freeaddrinfo)>;

[[noreturn]] void fail(const std::string& address, const std::string& why) {
  throw Error("cannot listen on " + address + ": " + why);
}
[[noreturn]] void fail(const std::string& address, int error) {
  fail(address, std::generic_category().message(error));
}

// It is no address.
[[noreturn]] void refuse(const std::string& address, const std::string& advice) {
  throw CLI::ValidationError("--listen", "cannot listen on " + address + ": " + advice);
}

shm::FileDescriptor make_socket(int family) {
  return shm::FileDescriptor(::socket(family, SOCK_STREAM | SOCK_NONBLOCK | SOCK_CLOEXEC, 0));
}

// Whether only this machine can reach it.
bool is_loopback(const sockaddr& address) {
  if (address.sa_family == AF_INET) {
    const auto& v4 = reinterpret_cast<const sockaddr_in&>(address);
    return (ntohl(v4.sin_addr.s_addr) >> 24) == IN_LOOPBACKNET;
  }
  return IN6_IS_ADDR_LOOPBACK(&reinterpret_cast<const sockaddr_in6&>(address).sin6_addr);
}

Addresses resolve(const std::string& text) {
  const auto colon = text.rfind(':');
  const std::string advice =
      "write ADDRESS:PORT, such as 127.0.0.1:9180 or [::1]:9180, or a "
      "socket's path, such as ./metrics or metrics.sock";
  if (colon == std::string::npos) refuse(text, advice);
  std::string host = text.substr(0, colon);
  const std::string port = text.substr(colon + 1);
  const bool in_brackets = host.size() > 2 && host.front() == '[' && host.back() == ']';
  if (in_brackets) host = host.substr(1, host.size() - 2);
  if (!in_brackets && host.find(':') != std::string::npos) refuse(text, advice);
  if (host == "localhost") host = "127.0.0.1";
  addrinfo hints{};
  hints.ai_socktype = SOCK_STREAM;
  hints.ai_flags = AI_NUMERICHOST | AI_NUMERICSERV | AI_PASSIVE;
  addrinfo* found = nullptr;
  // The library takes 99999 for another port.
  const bool is_port = !port.empty() && port.size() <= 5 &&
                       port.find_first_not_of("0123456789") == std::string::npos &&
                       std::stoi(port) <= 65535;
  if (host.empty() || !is_port || getaddrinfo(host.c_str(), port.c_str(), &hints, &found) != 0) {
    refuse(text, advice);
  }
  return {found, &freeaddrinfo};
}

std::string url_of(const shm::FileDescriptor& socket) {
  sockaddr_storage bound{};
  socklen_t size = sizeof bound;
  char host[INET6_ADDRSTRLEN] = "";
  char port[8] = "";
  auto* const address = reinterpret_cast<sockaddr*>(&bound);
  if (getsockname(socket.get(), address, &size) != 0 ||
      getnameinfo(address, size, host, sizeof host, port, sizeof port,
                  NI_NUMERICHOST | NI_NUMERICSERV) != 0) {
    return "";
  }
  const bool is_v6 = bound.ss_family == AF_INET6;
  return std::string("http://") + (is_v6 ? "[" : "") + host + (is_v6 ? "]:" : ":") + port;
}

Listening listen_on_port(const std::string& text, bool allow_remote) {
  const Addresses address = resolve(text);
  if (!allow_remote && !is_loopback(*address->ai_addr)) {
    fail(
        text,
        "other machines could reach it, and everybody there could read which ports this robot has; "
        "listen on 127.0.0.1 or on a path, or say --allow-remote");
  }
  Listening result;
  result.socket = make_socket(address->ai_family);
  const int on = 1;
  if (!result.socket ||
      setsockopt(result.socket.get(), SOL_SOCKET, SO_REUSEADDR, &on, sizeof on) != 0 ||
      bind(result.socket.get(), address->ai_addr, address->ai_addrlen) != 0 ||
      listen(result.socket.get(), kBacklog) != 0) {
    fail(text, errno);
  }
  result.url = url_of(result.socket);
  return result;
}

// Whether it is the socket of a program that has gone.
bool is_left_behind(const std::string& path, const sockaddr_un& address) {
  struct stat status {};
  if (lstat(path.c_str(), &status) != 0 || !S_ISSOCK(status.st_mode)) return false;
  const shm::FileDescriptor probe = make_socket(AF_UNIX);
  return probe &&
         connect(probe.get(), reinterpret_cast<const sockaddr*>(&address), sizeof address) != 0 &&
         errno == ECONNREFUSED;
}

Listening listen_on_path(const std::string& path) {
  sockaddr_un address{};
  address.sun_family = AF_UNIX;
  if (path.size() >= sizeof address.sun_path) fail(path, "the path is too long for a socket");
  std::memcpy(address.sun_path, path.c_str(), path.size() + 1);
  if (is_left_behind(path, address)) ::unlink(path.c_str());
  Listening result;
  result.socket = make_socket(AF_UNIX);
  const mode_t before = umask(0177);  // its owner may open it to others
  const bool is_bound =
      result.socket &&
      bind(result.socket.get(), reinterpret_cast<const sockaddr*>(&address), sizeof address) == 0;
  const int error = errno;
  umask(before);
  if (!is_bound) fail(path, error);
  result.path = path;
  if (listen(result.socket.get(), kBacklog) != 0) fail(path, errno);
  result.url = "unix:" + path;
  return result;
}

}  // namespace

Listening listen_on(const std::string& address, bool allow_remote) {
  const bool is_path = address.find('/') != std::string::npos || address.ends_with(".sock");
  return is_path ? listen_on_path(address) : listen_on_port(address, allow_remote);
}

}  // namespace arbiter::cli
