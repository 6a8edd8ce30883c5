// A gateway's loop: opens the ports of a mapping, sends what they take, looks after ages, idle
// samples and descriptions, until it is told to end.
//
// A gateway is open as a whole or not at all: where a port cannot be opened, because it is taken or
// the policy does not allow it, it says so and tries again once a second. A daemon that goes and
// comes again is the node's business (arbiter/node.hpp); samples pass meanwhile.
#pragma once

#include <deque>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include <arbiter/node.hpp>

#include "gateway/core/account.hpp"
#include "gateway/core/incoming.hpp"
#include "gateway/core/max_ages.hpp"
#include "gateway/core/middleware.hpp"
#include "gateway/core/outgoing.hpp"
#include "gateway/mapping/mapping.hpp"
#include "shm/file_descriptor.hpp"

namespace arbiter::gateway {

struct BridgeOptions {
  std::string name;      // of the node, and in the log
  std::string instance;  // as NodeOptions has it
};

class Bridge {
 public:
  // Of the gateways of that kind in `mapping`, which it keeps references to.
  Bridge(BridgeOptions options, const std::vector<Mapping>& mappings, Kind kind,
         Middleware& middleware);
  Bridge(const Bridge&) = delete;
  Bridge& operator=(const Bridge&) = delete;
  ~Bridge();

  // Returns when `stop` has become readable.
  void run(int stop);
  // Any thread, also a signal handler: lets the loop look at everything now.
  void wake() noexcept;

 private:
  struct Part;  // an entry with all that belongs to it

  bool open_all(int stop);
  void loop(int stop);

  const BridgeOptions options_;
  Middleware& middleware_;
  MaxAges max_ages_;
  shm::FileDescriptor bell_;
  std::optional<Node> node_;
  std::deque<Part> parts_;
};

}  // namespace arbiter::gateway
