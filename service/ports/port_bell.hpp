#pragma once

#include <sys/types.h>

#include <memory>
#include <utility>

#include "service/ports/pending_ring.hpp"
#include "shm/file_descriptor.hpp"

namespace arbiter::service {

// The write end of an input port's bell, as its component has handed it in and as it is passed on.
// The pipe's lock may be held by any process that has it, so ringing and closing are errands of the
// component's user.
class PortBell : public std::enable_shared_from_this<PortBell> {
 public:
  PortBell(shm::FileDescriptor pipe, uid_t user) : pipe_(std::move(pipe)), user_(user) {}
  PortBell(const PortBell&) = delete;
  PortBell& operator=(const PortBell&) = delete;
  ~PortBell();

  // Soon. Rings that are asked for meanwhile are this one.
  void ring() const;
  [[nodiscard]] int descriptor() const { return pipe_.get(); }

 private:
  shm::FileDescriptor pipe_;
  const uid_t user_;
  mutable PendingRing pending_;
};

}  // namespace arbiter::service
