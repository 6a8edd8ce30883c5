// The last components that ended without closing their ports, for the status document.
#pragma once

#include <cstdint>
#include <deque>
#include <string>

#include "service/log/event.hpp"
#include "shm/clock.hpp"
#include "wire/status.hpp"

namespace arbiter::service {

class Deaths {
 public:
  static constexpr std::size_t kMost = 16;

  // `event`: as the log tells of it.
  void note(const Event& event, std::int32_t pid, std::uint32_t user) {
    deaths_.push_front({event.components.empty() ? "" : std::string(event.components.front()),
                        pid,
                        user,
                        shm::monotonic_now(),
                        {event.sources.begin(), event.sources.end()},
                        {event.ports.begin(), event.ports.end()}});
    if (deaths_.size() > kMost) deaths_.pop_back();
  }
  [[nodiscard]] const std::deque<wire::DeathStatus>& all() const { return deaths_; }

 private:
  std::deque<wire::DeathStatus> deaths_;  // the latest first
};

}  // namespace arbiter::service
