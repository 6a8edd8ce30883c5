// What is said again and again is said once a while, with how often it came meanwhile.
//
// Thread safety: any thread.
#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <mutex>
#include <string>
#include <utility>

#include "shm/activity.hpp"

namespace arbiter::gateway::dds {

class Repeats {
 public:
  explicit Repeats(shm::Nanoseconds period) noexcept : period_(period) {}

  // Whether it is time to say it: it was not said within the period. If not, it is counted.
  [[nodiscard]] bool is_due(const std::string& text, shm::Nanoseconds now) {
    const std::lock_guard lock(mutex_);
    Said* const known = find(text);
    if (known == nullptr || now - known->last >= period_) return true;
    ++known->left_out;
    return false;
  }
  // It is said now. Returns how often it was not since the last time, as far as that is known.
  std::uint64_t note(const std::string& text, shm::Nanoseconds now) {
    const std::lock_guard lock(mutex_);
    if (Said* const known = find(text)) {
      known->last = now;
      return std::exchange(known->left_out, 0);
    }
    Said& oldest = *std::min_element(said_.begin(), said_.end(),
                                     [](const Said& a, const Said& b) { return a.last < b.last; });
    oldest = {text, now, 0};
    return 0;
  }

 private:
  struct Said {
    std::string text;
    shm::Nanoseconds last = 0;
    std::uint64_t left_out = 0;
  };

  Said* find(const std::string& text) {
    const auto found = std::find_if(said_.begin(), said_.end(),
                                    [&](const Said& each) { return each.text == text; });
    return found == said_.end() ? nullptr : &*found;
  }

  const shm::Nanoseconds period_;
  std::mutex mutex_;
  std::array<Said, 16> said_;  // those that were said last
};

}  // namespace arbiter::gateway::dds
