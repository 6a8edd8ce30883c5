// Making clients acquainted with ports that are new to them.
//
// First the publishers take up what they were told, and thereby use more of their segments; then
// the receivers do, and map what the publishers use. So the first sample after an introduction is
// not lost to a race.
#pragma once

#include <functional>

#include "service/clients/barriers.hpp"
#include "service/ports/switchboard.hpp"
#include "shm/activity.hpp"

namespace arbiter::service {

// How long after a connection was made the publisher's other receivers are told that it uses more
// memory: so long that they are told once of many.
constexpr shm::Nanoseconds kShowGrowthAfter = 250'000'000;

class Introductions {
 public:
  Introductions(Switchboard& switchboard, Barriers& barriers)
      : switchboard_(switchboard), barriers_(barriers) {}

  // Calls `passed` once clients have taken up what they were told, or have had the time for it.
  void introduce(const Switchboard::Told& told, const std::function<void()>& passed);
  // That publishers use more memory is told within kShowGrowthAfter.
  void show_growth_soon();
  // Tells receivers what is not urgent, when it is time for that.
  void advance(shm::Nanoseconds now);
  [[nodiscard]] shm::Nanoseconds deadline() const { return show_growth_at_; }

 private:
  Switchboard& switchboard_;
  Barriers& barriers_;
  shm::Nanoseconds show_growth_at_ = shm::kForever;
};

}  // namespace arbiter::service
