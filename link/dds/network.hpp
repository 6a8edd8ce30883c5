// The network as links share it: a domain of DDS, and our participant in it.
#pragma once

#include <dds/dds.h>

#include <cstdint>
#include <string>
#include <vector>

#include "gateway/dds/entity.hpp"

namespace arbiter::link {

using gateway::dds::DdsError;
using gateway::dds::Entity;

struct NetworkOptions {
  std::uint32_t domain = 43;
  // By name or address. None: the loopback interface, and nothing leaves this machine.
  std::vector<std::string> interfaces;
  // Hosts that multicast does not reach.
  std::vector<std::string> peers;
};

// Cyclone's configuration for it. CYCLONEDDS_URI is not looked at: all links must agree.
[[nodiscard]] std::string configuration_of(const NetworkOptions& options);

class Network {
 public:
  // Throws DdsError: there is no such network interface now, for example.
  explicit Network(const NetworkOptions& options);

  [[nodiscard]] dds_entity_t participant() const { return participant_.get(); }

 private:
  Entity domain_;
  Entity participant_;
};

}  // namespace arbiter::link
