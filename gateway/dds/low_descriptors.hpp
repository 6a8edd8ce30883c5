// Descriptors that are kept free for Cyclone DDS.
//
// Cyclone waits for its sockets by select(), which takes descriptors below 1024 alone: a socket
// beyond ends the process. Each entry of the gateway needs at least three, so with some 340 entries
// none would be left. They are held from the start, and let go while a domain is joined.
//
// Thread safety: one thread. Other threads may take a few of those that are let go.
#pragma once

#include <cstddef>
#include <vector>

#include "shm/file_descriptor.hpp"

namespace arbiter::gateway::dds {

class LowDescriptors {
 public:
  // Holds up to `count`. What cannot be had below 1024 is not held.
  void hold(std::size_t count) noexcept;
  void let_go() noexcept { held_.clear(); }
  [[nodiscard]] std::size_t held() const noexcept { return held_.size(); }

 private:
  std::vector<shm::FileDescriptor> held_;
};

}  // namespace arbiter::gateway::dds
