// Network namespaces with cables between them: each host has a network of its own, with one
// interface, "eth0", whose cable leads to a switch.
//
// Needs root, and iproute2 and util-linux. Everything goes with the processes that hold the
// namespaces, however the test ends.
#pragma once

#include <fcntl.h>
#include <gtest/gtest.h>
#include <poll.h>
#include <sched.h>
#include <unistd.h>

#include <filesystem>
#include <functional>
#include <stdexcept>
#include <string>
#include <thread>
#include <vector>

#include "shm/file_descriptor.hpp"
#include "tests/support/child_process.hpp"

namespace arbiter::test {

// Whether this user may make networks here; else why not.
inline std::string why_no_networks() {
  if (::geteuid() != 0) return "networks for tests can be made by root only";
  ChildProcess unshare({"/usr/bin/unshare", "-n", "/bin/true"}, {}, {});
  if (unshare.wait() != 0) return "this machine lets nobody make network namespaces";
  ChildProcess ip({"/usr/sbin/ip", "-V"}, {}, {});
  return ip.wait() == 0 ? "" : "there is no /usr/sbin/ip: install iproute2";
}

class NetworkNamespace {
 public:
  NetworkNamespace() : holder_({"/usr/bin/unshare", "-n", "/bin/sleep", "infinity"}, {}, {}) {
    const auto mine = std::filesystem::read_symlink("/proc/self/ns/net");
    const std::string its = "/proc/" + pid() + "/ns/net";
    while (std::filesystem::read_symlink(its) == mine) ::poll(nullptr, 0, 1);
    ip("link set lo up");
  }
  [[nodiscard]] std::string pid() const { return std::to_string(holder_.pid()); }
  // What a program is started by that lives there.
  [[nodiscard]] std::vector<std::string> enter() const {
    return {"/usr/bin/nsenter", "--net=/proc/" + pid() + "/ns/net"};
  }
  void ip(const std::string& words) const {
    std::vector<std::string> command = enter();
    command.insert(command.end(), {"/bin/sh", "-c", "exec /usr/sbin/ip " + words});
    ChildProcess process(command, {}, {});
    if (process.wait() != 0) throw std::runtime_error("ip " + words);
  }

 private:
  ChildProcess holder_;
};

// On a thread whose network, and that of the threads it makes, is that place's.
inline void run_in(const NetworkNamespace& place, const std::function<void()>& run) {
  std::thread thread([&] {
    const shm::FileDescriptor there(
        ::open(("/proc/" + place.pid() + "/ns/net").c_str(), O_RDONLY | O_CLOEXEC));
    ASSERT_EQ(::setns(there.get(), CLONE_NEWNET), 0);
    run();
  });
  thread.join();
}

class Switch {
 public:
  Switch() {
    place_.ip("link add switch0 type bridge");
    place_.ip("link set switch0 up");
  }
  // The host's "eth0" gets the address 10.77.0.NUMBER.
  void connect(const NetworkNamespace& host, int number) {
    const std::string port = port_of(number);
    place_.ip("link add " + port + " type veth peer name eth0 netns " + host.pid());
    place_.ip("link set " + port + " master switch0 up");
    host.ip("addr add 10.77.0." + std::to_string(number) + "/24 dev eth0");
    host.ip("link set eth0 up");
  }
  // Pulls the cable, and puts it back.
  void cut(int number) const { place_.ip("link set " + port_of(number) + " down"); }
  void heal(int number) const { place_.ip("link set " + port_of(number) + " up"); }
  // From now on nothing gets to that host, and what it sends gets to others.
  void cut_to(int number) const {
    place_.ip("link set switch0 type bridge mcast_snooping 0");
    place_.ip("link set " + port_of(number) + " type bridge_slave learning off flood off " +
              "mcast_flood off bcast_flood off");
    place_.ip("link set " + port_of(number) + " type bridge_slave fdb_flush");
  }
  void heal_to(int number) const {
    place_.ip("link set " + port_of(number) + " type bridge_slave learning on flood on " +
              "mcast_flood on bcast_flood on");
  }
  // From now on no multicast gets to that host; broadcasts, of which addresses are resolved by, do.
  void drop_multicast_to(int number) const {
    place_.ip("link set switch0 type bridge mcast_snooping 0");
    place_.ip("link set " + port_of(number) + " type bridge_slave mcast_flood off");
  }

 private:
  static std::string port_of(int number) { return "port" + std::to_string(number); }

  NetworkNamespace place_;
};

}  // namespace arbiter::test
