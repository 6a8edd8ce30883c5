#include "service/ports/introductions.hpp"

#include "service/kept/step.hpp"
#include "shm/clock.hpp"

namespace arbiter::service {

void Introductions::introduce(const Switchboard::Told& told, const std::function<void()>& passed) {
  const shm::Nanoseconds deadline = shm::monotonic_now() + kMaxWaitForClients;
  // Another introduction may pass its barrier first: these links are none of its.
  barriers_.raise(told, deadline, [=, this, fresh = switchboard_.take_fresh()] {
    const auto receivers = switchboard_.show_segments(fresh);
    at_step("segments-shown");
    show_growth_soon();
    barriers_.raise(receivers, deadline, passed);
  });
}

void Introductions::show_growth_soon() {
  if (switchboard_.has_growth_to_show() && show_growth_at_ == shm::kForever) {
    show_growth_at_ = shm::monotonic_now() + kShowGrowthAfter;
  }
}

void Introductions::advance(shm::Nanoseconds now) {
  if (now < show_growth_at_) return;
  switchboard_.show_growth();
  show_growth_at_ = switchboard_.has_growth_to_show() ? now + kShowGrowthAfter : shm::kForever;
}

}  // namespace arbiter::service
