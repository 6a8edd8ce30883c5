// Whether a ring of a bell has been asked for that has yet to begin: rings that are asked for
// meanwhile are that one.
//
// Thread safety: the loop asks, the thread of an errand begins.
#pragma once

#include "shm/atomic.hpp"

namespace arbiter::service {

class PendingRing {
 public:
  // True: one is pending, and whoever it wakes sees what the caller did before this. SYNC POINT:
  // ring-asked. The release pairs with the acquire in begin(), though the ring that begins there
  // was asked for earlier: both replace the word, so that the later sees what came before the
  // former.
  [[nodiscard]] bool ask() noexcept { return asked_.exchange(true, std::memory_order_release); }
  // Before the bell is rung. SYNC POINT: ring-asked
  void begin() noexcept { static_cast<void>(asked_.exchange(false, std::memory_order_acquire)); }

 private:
  shm::Atomic<bool> asked_{false};
};

}  // namespace arbiter::service
