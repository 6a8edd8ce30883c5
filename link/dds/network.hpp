// The network as links share it: a domain of DDS, and our participant in it.
#pragma once

#include <dds/dds.h>

#include <cstdint>
#include <string>
#include <vector>

#include "gateway/dds/entity.hpp"
#include "shm/file_descriptor.hpp"

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

// A domain, and the sockets that Cyclone makes for it.
//
// Cyclone ends its receiving threads by sending to its own address. If that address is gone, it
// would wait for them for ever: they are woken by the end of what they read from.
class Domain {
 public:
  // Throws DdsError.
  explicit Domain(const NetworkOptions& options);
  Domain(const Domain&) = delete;
  Domain& operator=(const Domain&) = delete;
  // Takes a second longer than Cyclone needs where it still has its address, at most.
  ~Domain();

  void note_cut_off() noexcept { is_cut_off_ = true; }

 private:
  void wake_receivers() const noexcept;

  // Of our own, so that none is another one's by the time it is used.
  std::vector<shm::FileDescriptor> sockets_;
  bool is_cut_off_ = false;
  Entity entity_;
};

class Network {
 public:
  // Throws DdsError: there is no such network interface now, for example.
  explicit Network(const NetworkOptions& options);

  // Its address may be gone: nothing is waited for when this ends.
  void note_cut_off() noexcept { domain_.note_cut_off(); }

  [[nodiscard]] dds_entity_t participant() const { return participant_.get(); }

 private:
  Domain domain_;
  Entity participant_;
};

}  // namespace arbiter::link
