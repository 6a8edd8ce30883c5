#include "network.hpp"

#include <fcntl.h>
#include <sched.h>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cerrno>
#include <exception>
#include <fstream>
#include <stdexcept>
#include <system_error>
#include <thread>

namespace hosts_demo {
namespace {

void require(bool is_done, const char* what) {
  if (!is_done) throw std::system_error(errno, std::generic_category(), what);
}

void write_file(const char* path, const std::string& text) {
  std::ofstream file(path);
  file << text << std::flush;
  require(file.good(), path);
}

void become_root() {
  if (::geteuid() == 0) return;
  const std::string user = std::to_string(::geteuid());
  const std::string group = std::to_string(::getegid());
  require(::unshare(CLONE_NEWUSER) == 0, "a user namespace");
  write_file("/proc/self/setgroups", "deny");
  write_file("/proc/self/uid_map", "0 " + user + " 1");
  write_file("/proc/self/gid_map", "0 " + group + " 1");
}

// In the network of the calling thread.
void ip(const std::string& words) {
  const std::string command = "PATH=$PATH:/usr/sbin:/sbin exec ip " + words + " 2>/dev/null";
  std::array<const char*, 4> arguments{"/bin/sh", "-c", command.c_str(), nullptr};
  pid_t child = -1;
  errno = ::posix_spawn(&child, arguments[0], nullptr, nullptr,
                        const_cast<char* const*>(arguments.data()), ::environ);
  require(errno == 0, "/bin/sh");
  int status = 0;
  while (::waitpid(child, &status, 0) < 0 && errno == EINTR) {
  }
  if (status != 0) throw std::runtime_error("ip " + words + " failed (is iproute2 there?)");
}

// What a thread throws is thrown to who waits for it.
void on_a_thread(const std::function<void()>& work) {
  std::exception_ptr error;
  std::thread thread([&] {
    try {
      work();
    } catch (...) {
      error = std::current_exception();
    }
  });
  thread.join();
  if (error) std::rethrow_exception(error);
}

}  // namespace

Network::Network(bool is_wanted) {
  if (!is_wanted) {
    obstacle_ = "--loopback";
    return;
  }
  try {
    become_root();
    make();
  } catch (const std::exception& error) {
    obstacle_ = error.what();
  }
}

Network::~Network() {
  for (const int each : namespaces_) {
    if (each >= 0) ::close(each);
  }
}

void Network::inside(std::size_t host, const std::function<void()>& work) const {
  on_a_thread([&] {
    require(::setns(namespaces_[host], CLONE_NEWNET) == 0, "setns");
    work();
  });
}

void Network::make() {
  for (int& each : namespaces_) {
    on_a_thread([&each] {
      require(::unshare(CLONE_NEWNET) == 0, "a network namespace");
      each = ::open("/proc/thread-self/ns/net", O_RDONLY | O_CLOEXEC);
      require(each >= 0, "/proc/thread-self/ns/net");
      ip("link set lo up");
    });
  }
  const std::string other =
      "/proc/" + std::to_string(::getpid()) + "/fd/" + std::to_string(namespaces_[kBody]);
  inside(kHead, [&] { ip("link add eth0 type veth peer name eth0 netns " + other); });
  for (std::size_t host = 0; host < kHosts; ++host) {
    inside(host, [&] {
      ip("addr add 10.77.0." + std::to_string(host + 1) + "/24 dev eth0");
      ip("link set eth0 up");
    });
  }
}

std::vector<std::string> Network::enter(std::size_t host) const {
  if (!obstacle_.empty()) return {};
  return {"/usr/bin/nsenter",
          "--net=/proc/" + std::to_string(::getpid()) + "/fd/" + std::to_string(namespaces_[host])};
}

// The head's end is taken out; the body sees that nothing is at the other one.
void Network::pull() const {
  inside(kHead, [] { ip("link set eth0 down"); });
}

void Network::put_back() const {
  inside(kHead, [] { ip("link set eth0 up"); });
}

}  // namespace hosts_demo
