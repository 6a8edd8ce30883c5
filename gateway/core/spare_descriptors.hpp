// Descriptors, of which each port of a gateway needs three, and more for its connections: a mapping
// may have hundreds of entries, and what is left must do for the middleware and for all else.
#pragma once

#include <cstddef>
#include <vector>

#include "shm/file_descriptor.hpp"

namespace arbiter::gateway {

// Held while ports are opened, so that not the last descriptor goes to a port.
//
// Thread safety: one thread. Other threads may want some meanwhile.
class SpareDescriptors {
 public:
  SpareDescriptors() noexcept;
  // Whether there is room for one entry's ports beside those that are held. Where there was none,
  // there is none any more: who asks for hundreds of entries is answered at once.
  [[nodiscard]] bool leave_room() noexcept;
  void let_go() noexcept { held_.clear(); }

 private:
  static constexpr std::size_t kSpare = 64;    // Cyclone needs some ten for a domain, iceoryx six
  static constexpr std::size_t kOfEntry = 16;  // which may have two ports

  // False: there are not as many.
  static bool take(std::size_t count, std::vector<shm::FileDescriptor>& to) noexcept;

  std::vector<shm::FileDescriptor> held_;
  bool is_any_left_;
};

}  // namespace arbiter::gateway
