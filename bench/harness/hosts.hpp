// Hosts on this machine: each has a network of its own, an arbiterd and an arbiter-link. Their
// interfaces, "eth0", are on one switch.
//
// Needs root, for the networks; and iproute2 and util-linux. All of it ends with its objects.
#pragma once

#include <poll.h>

#include <cstdint>
#include <string>
#include <vector>

#include "bench/harness/cpu.hpp"
#include "bench/harness/interruption.hpp"
#include "bench/harness/program.hpp"
#include "bench/harness/robot.hpp"
#include "bench/harness/worker.hpp"

namespace arbiter::bench {

// A network namespace, which a process holds that does nothing else.
class NetworkSpace {
 public:
  // Throws BenchError where that cannot be made.
  NetworkSpace();

  // What a program is started by that lives there.
  [[nodiscard]] std::vector<std::string> enter() const;
  // The calling process lives there from now on.
  void move_in() const;
  // Throws BenchError where `ip` refuses.
  void ip(const std::string& words) const;
  // Need not ask for the addresses of the hosts 1 to `count` of its switch: all network spaces of a
  // machine share one table for what they have asked, by default for 1024 entries.
  void know_neighbours(int count) const;
  [[nodiscard]] pid_t holder() const { return holder_.pid(); }
  // Of "eth0", sent and received, with what Ethernet and IP add.
  [[nodiscard]] std::uint64_t bytes() const;

 private:
  ScratchDirectory directory_;
  Program holder_;
};

// In a model: sources that it does not connect. A component may have them open without a remark.
[[nodiscard]] std::string declared(const std::vector<std::string>& sources);

class NetworkSwitch {
 public:
  NetworkSwitch();
  // The space has "eth0" from now on, with an address of its own.
  void connect(const NetworkSpace& space);

 private:
  NetworkSpace place_;
  int connected_ = 0;
};

class LinkedHost {
 public:
  // `model`: the text of its model.
  LinkedHost(std::string name, const std::string& model, NetworkSwitch& on);

  [[nodiscard]] const Robot& robot() const { return robot_; }
  [[nodiscard]] const NetworkSpace& space() const { return space_; }
  void start_link();
  void stop_link() { link_ = Program(); }
  [[nodiscard]] pid_t link() const { return link_.pid(); }
  // How many sources of other hosts it has open now; asks the daemon.
  [[nodiscard]] int imported() const;
  // Returns once it has so many; throws BenchError, with what the link has said, after a minute.
  void await_imported(int count) const;

 private:
  const std::string name_;
  NetworkSpace space_;
  Robot robot_;
  Program link_;
};

// Asks again and again; throws BenchError where it does not hold within a minute.
template <class Holds>
void await_in_a_minute(const std::string& what, const Holds& holds) {
  const std::int64_t end = now_ns() + 60'000'000'000;
  while (!holds()) {
    throw_if_interrupted();
    if (now_ns() > end) throw BenchError("not within a minute: " + what);
    ::poll(nullptr, 0, 5);
  }
}

}  // namespace arbiter::bench
