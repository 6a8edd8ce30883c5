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
  // The folder with what DDS Security needs (security.hpp), and the name that this host's
  // certificate there has. No folder: without it.
  std::string security{};
  std::string name{};
};

// Cyclone's configuration for it. CYCLONEDDS_URI is not looked at: all links must agree.
[[nodiscard]] std::string configuration_of(const NetworkOptions& options);

class Network {
 public:
  // Throws DdsError: there is no such network interface now, for example.
  explicit Network(const NetworkOptions& options);
  Network(const Network&) = delete;
  Network& operator=(const Network&) = delete;
  ~Network();

  // Its address may be gone. Cyclone ends its receiving threads by sending to itself, and would
  // wait for them for ever: they are woken otherwise when this ends.
  void note_cut_off() noexcept { is_cut_off_ = true; }

  [[nodiscard]] dds_entity_t participant() const { return participant_.get(); }

 private:
  std::vector<int> sockets_;  // Cyclone's; before it makes them: those that are others'
  bool is_cut_off_ = false;
  Entity domain_;
  Entity participant_;
};

}  // namespace arbiter::link
