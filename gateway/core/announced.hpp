// Something that one thread makes, and that others use once it is made.
#pragma once

#include "shm/atomic.hpp"

namespace arbiter::gateway {

template <class T>
class Announced {
 public:
  // From the thread that has made it.
  void announce(T& made) noexcept {
    // SYNC POINT: made-announced (release): who sees it finds it made, and what was made before.
    made_.store(&made, std::memory_order_release);
  }
  // It is not to be used any more.
  void withdraw() noexcept { made_.store(nullptr, std::memory_order_relaxed); }
  // Null: it is not there yet, or not any more. Any thread.
  [[nodiscard]] T* get() const noexcept {
    // SYNC POINT: made-announced (acquire)
    return made_.load(std::memory_order_acquire);
  }

 private:
  shm::Atomic<T*> made_{nullptr};
};

}  // namespace arbiter::gateway
