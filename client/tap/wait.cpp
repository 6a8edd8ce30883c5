// The tap's thread: waiting for an event.
#include <algorithm>

#include "client/tap/tap_core.hpp"
#include "shm/atomic.hpp"
#include "shm/bell.hpp"
#include "shm/clock.hpp"

namespace arbiter::detail {
namespace {

// How often a tap that waits looks at the input ports' counters: nobody rings for them.
constexpr shm::Nanoseconds kLookIntervalAsleep = 100'000'000;

}  // namespace

// Says that we wait. SYNC POINT: tap-waiting. Fence (g), between our wait word and our last look.
// Pairs with fence (f) of publishers, and with the offer of a view.
void TapCore::arm() noexcept {
  // Relaxed is enough for what we alone write.
  segment_->wait.store((segment_->wait.load(std::memory_order_relaxed) + 1) | 1,
                       std::memory_order_relaxed);
  shm::full_fence();  // (g)
}

// The next wait has another number. What rang for this one is forgotten before the next begins.
void TapCore::disarm() noexcept {
  const std::uint64_t wait = segment_->wait.load(std::memory_order_relaxed);
  if ((wait & 1) != 0) segment_->wait.store(wait + 1, std::memory_order_relaxed);
  bell_.silence();
}

void TapCore::require_may_wait() const {
  if (!options_.may_wait) {
    throw Error(name_ + ": a tap without may_wait polls; open it with TapOptions::may_wait");
  }
}

bool TapCore::wait(shm::Nanoseconds timeout, TapEventData& event) {
  require_may_wait();
  bool found = take_once(event);
  if (!found) {
    const shm::Nanoseconds now = shm::monotonic_now();
    const shm::Nanoseconds deadline = timeout > shm::kMaxTime - now ? shm::kForever : now + timeout;
    for (;;) {
      arm();
      found = take_once(event);
      const shm::Nanoseconds time = shm::monotonic_now();
      if (found || time >= deadline) break;
      const bool looks = view_ != nullptr && !view_->inputs.empty();
      bell_.wait(looks ? std::min(deadline, time + kLookIntervalAsleep) : deadline);
      disarm();
    }
    disarm();
  }
  // A descriptor in use was disarmed by this; let its owner's loop arm it again.
  if (has_descriptor_) shm::ring_bell(bell_.write_end().get());
  return found;
}

int TapCore::wait_descriptor() {
  require_may_wait();
  if (!has_descriptor_) {
    has_descriptor_ = true;
    shm::ring_bell(bell_.write_end().get());  // what waits already is there to be taken
  }
  return bell_.read_end();
}

}  // namespace arbiter::detail
