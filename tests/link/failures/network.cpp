#include "tests/link/failures/network.hpp"

#include <fcntl.h>
#include <linux/if_tun.h>
#include <net/if.h>
#include <sched.h>
#include <sys/ioctl.h>
#include <unistd.h>

#include <cstdio>
#include <cstring>
#include <exception>
#include <stdexcept>
#include <system_error>
#include <thread>

#include "tests/support/child_process.hpp"

namespace arbiter::failures {
namespace {

void require(bool is_done, const char* what) {
  if (!is_done) throw std::system_error(errno, std::generic_category(), what);
}

// In the namespace of the calling thread.
void ip(const std::string& words) {
  test::ChildProcess process({"/bin/sh", "-c", "exec /usr/sbin/ip " + words}, {}, {});
  if (process.wait() != 0) throw std::runtime_error("ip " + words);
}

}  // namespace

HostNetwork::HostNetwork(unsigned number) : number_(number) {
  std::exception_ptr error;
  std::thread thread([&] {
    try {
      require(::unshare(CLONE_NEWNET) == 0, "a network namespace");
      namespace_.reset(::open("/proc/thread-self/ns/net", O_RDONLY | O_CLOEXEC));
      require(namespace_.get() >= 0, "/proc/thread-self/ns/net");
      ip("link set lo up");
    } catch (...) {
      error = std::current_exception();
    }
  });
  thread.join();
  if (error) std::rethrow_exception(error);
}

void HostNetwork::inside(const std::function<void()>& work) const {
  std::exception_ptr error;
  std::thread thread([&] {
    try {
      require(::setns(namespace_.get(), CLONE_NEWNET) == 0, "setns");
      work();
    } catch (...) {
      error = std::current_exception();
    }
  });
  thread.join();
  if (error) std::rethrow_exception(error);
}

void HostNetwork::plug_in() {
  inside([this] {
    cable_.reset(::open("/dev/net/tun", O_RDWR | O_NONBLOCK | O_CLOEXEC));
    require(cable_.get() >= 0, "/dev/net/tun");
    ifreq request{};
    std::strcpy(request.ifr_name, "eth0");
    request.ifr_flags = IFF_TAP | IFF_NO_PI;
    require(::ioctl(cable_.get(), TUNSETIFF, &request) == 0, "a TAP device");
    char address[18];
    std::snprintf(address, sizeof address, "02:77:00:00:00:%02x", number_ & 0xffU);
    // No second family of addresses, whose chatter nobody needs.
    ip(std::string("link set eth0 address ") + address + " addrgenmode none");
    ip("addr add 10.77.0." + std::to_string(number_) + "/24 dev eth0");
    ip("link set eth0 txqueuelen 2000 up");
  });
}

void HostNetwork::set_up(bool is_up) const {
  inside([&] { ip(std::string("link set eth0 ") + (is_up ? "up" : "down")); });
}

std::vector<std::string> HostNetwork::enter() const {
  return {"/usr/bin/nsenter",
          "--net=/proc/" + std::to_string(::getpid()) + "/fd/" + std::to_string(namespace_.get())};
}

unsigned receiver_of(const unsigned char* frame) noexcept {
  constexpr unsigned char kOurs[] = {0x02, 0x77, 0, 0, 0};
  return std::memcmp(frame, kOurs, sizeof kOurs) == 0 ? frame[5] : 0U;
}

}  // namespace arbiter::failures
