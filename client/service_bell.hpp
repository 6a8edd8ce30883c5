// How a port's thread tells the service thread that there is something to tidy up.
#pragma once

#include <sys/eventfd.h>
#include <unistd.h>

#include <cerrno>
#include <cstdint>
#include <system_error>

#include "shm/descendants.hpp"
#include "shm/file_descriptor.hpp"

namespace arbiter::detail {

class ServiceBell {
 public:
  // Throws std::system_error.
  ServiceBell() : event_(eventfd(0, EFD_CLOEXEC | EFD_NONBLOCK)) {
    if (!event_) throw std::system_error(errno, std::generic_category(), "eventfd");
    shm::close_in_children(event_);
  }

  void ring() const noexcept {
    const std::uint64_t one = 1;
    static_cast<void>(!::write(event_.get(), &one, sizeof one));  // full means rung
  }
  void silence() const noexcept {
    std::uint64_t rings = 0;
    static_cast<void>(!::read(event_.get(), &rings, sizeof rings));
  }
  [[nodiscard]] int descriptor() const noexcept { return event_.get(); }

 private:
  shm::FileDescriptor event_;
};

}  // namespace arbiter::detail
