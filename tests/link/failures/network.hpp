// Hosts' networks that leave nothing behind: a network namespace that lives as long as a descriptor
// of it, and in it a TAP device, "eth0", that lives as long as its own. However the program ends,
// both are gone.
//
// Needs root. Thread safety: none.
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "shm/file_descriptor.hpp"

namespace arbiter::failures {

class HostNetwork {
 public:
  // `number`, 1 to 254, is in its addresses. It has only a loopback interface until plug_in().
  // Throws std::runtime_error.
  explicit HostNetwork(unsigned number);

  // Makes "eth0" with 10.77.0.NUMBER. A frame that is read from the descriptor is one that the host
  // has sent, one that is written there is one that it gets.
  void plug_in();
  [[nodiscard]] int cable() const { return cable_.get(); }
  // Whether the interface is up: down is what its host sees when its own cable is pulled.
  void set_up(bool is_up) const;
  // What a program is started by that lives there.
  [[nodiscard]] std::vector<std::string> enter() const;

 private:
  // On a thread of its own that is in the namespace.
  void inside(const std::function<void()>& work) const;

  const unsigned number_;
  shm::FileDescriptor namespace_;
  shm::FileDescriptor cable_;
};

// The number of the host to which the frame goes by its address; 0: to all.
[[nodiscard]] unsigned receiver_of(const unsigned char* frame) noexcept;

}  // namespace arbiter::failures
