// The last components that ended without closing their ports, for the status document.
#pragma once

#include <algorithm>
#include <cstdint>
#include <deque>
#include <string>
#include <vector>

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
                        {event.ports.begin(), event.ports.end()},
                        {}});
    if (deaths_.size() > kMost) make_room();
  }
  void note_output_opened(const std::string& name) {
    note_opened(&wire::DeathStatus::outputs, name);
  }
  void note_input_opened(const std::string& name) { note_opened(&wire::DeathStatus::inputs, name); }
  [[nodiscard]] const std::deque<wire::DeathStatus>& all() const { return deaths_; }

 private:
  void note_opened(std::vector<std::string> wire::DeathStatus::*left_open,
                   const std::string& name) {
    const auto has = [&](const std::vector<std::string>& names) {
      return std::find(names.begin(), names.end(), name) != names.end();
    };
    for (wire::DeathStatus& death : deaths_) {
      if (has(death.*left_open) && !has(death.opened_since)) death.opened_since.push_back(name);
    }
  }
  // The user who has most gives way, and the earliest of these: nobody pushes out what others miss.
  void make_room() {
    const auto count = [&](const wire::DeathStatus& death) {
      return std::count_if(deaths_.begin(), deaths_.end(),
                           [&](const auto& each) { return each.user == death.user; });
    };
    // From the earliest on; of equals the first one.
    const auto most = std::max_element(
        deaths_.rbegin(), deaths_.rend(),
        [&](const auto& one, const auto& other) { return count(one) < count(other); });
    deaths_.erase(std::next(most).base());
  }

  std::deque<wire::DeathStatus> deaths_;  // the latest first
};

}  // namespace arbiter::service
