// A multiplexer in user space, as robots have it today: a process between the sources and the
// destinations, which receives what the sources send, remembers when each was last heard, evaluates
// rules in Lua, and passes on what may pass.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "bench/harness/worker.hpp"
#include "shm/file_descriptor.hpp"

namespace arbiter::bench {

// A Unix datagram socket's two ends.
struct DatagramPair {
  // `bytes`: of the largest sample.
  explicit DatagramPair(std::size_t bytes);

  shm::FileDescriptor write;
  shm::FileDescriptor read;
};

struct RelayOptions {
  std::size_t bytes = 64;  // of the largest sample
  std::int64_t timeout_ns = 500'000'000;
  bool tells_idle =
      false;  // sends an empty datagram to a destination when nobody commands any more
};

class Relay {
 public:
  struct Source {
    std::string name;         // of its variable in the rules
    std::string rule;         // in Lua: what must hold for it to pass; empty: it never does
    std::size_t destination;  // index
  };

  Relay(std::vector<Source> sources, std::size_t destinations, const RelayOptions& options);

  // Where a source writes, and a destination reads. An empty datagram of a source ends its
  // activity.
  [[nodiscard]] int to(std::size_t source) const { return in_.at(source).write.get(); }
  [[nodiscard]] int from(std::size_t destination) const { return out_.at(destination).read.get(); }

 private:
  void run();

  std::vector<Source> sources_;
  RelayOptions options_;
  std::vector<DatagramPair> in_;
  std::vector<DatagramPair> out_;
  Worker worker_;
};

// not s1 and not s2 ...: of `names`.
std::string none_of(const std::vector<std::string>& names);

}  // namespace arbiter::bench
