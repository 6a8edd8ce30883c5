// What all ports of a node see of the daemon: the tables, and the activity of sources.
#pragma once

#include <memory>
#include <utility>

#include "client/service_bell.hpp"
#include "shm/atomic.hpp"
#include "shm/decision.hpp"
#include "shm/decision_memory.hpp"

namespace arbiter::detail {

// Whether a port's decisions have missed a source that the port cannot see, which its component
// should know once. Begins at most once.
class Blindness {
 public:
  // Port's thread. True once.
  bool begins() noexcept {
    if (begun_.load(std::memory_order_relaxed)) return false;
    begun_.store(true, std::memory_order_relaxed);
    return true;
  }
  // Service thread. True once, after it has begun. Relaxed is enough: nothing is read by it.
  bool is_news() noexcept {
    return begun_.load(std::memory_order_relaxed) && !std::exchange(told_, true);
  }

 private:
  shm::Atomic<bool> begun_{false};
  bool told_ = false;
};

// Thread safety: the service thread adds pages and names; every thread reads.
class SharedMemory : public shm::DecisionMemory {
 public:
  // The registry is kept for the daemon's successor. Throws std::system_error, std::runtime_error.
  SharedMemory(shm::FileDescriptor board, shm::FileDescriptor registry,
               std::shared_ptr<const ServiceBell> service_bell,
               shm::Residence residence = shm::Residence::kMapped)
      : DecisionMemory(std::move(board), residence, Whose::kComponents),
        service_bell_(std::move(service_bell)),
        registry_(std::move(registry)) {
    shm::close_in_children(registry_);
  }

  // Service thread: what a daemon that takes over is handed back besides.
  [[nodiscard]] const shm::FileDescriptor& registry() const noexcept { return registry_; }
  [[nodiscard]] const ServiceBell& service_bell() const noexcept { return *service_bell_; }

 private:
  const std::shared_ptr<const ServiceBell> service_bell_;
  shm::FileDescriptor registry_;
};

}  // namespace arbiter::detail
