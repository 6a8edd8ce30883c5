// What is said again and again is said once a while, with how often it came meanwhile.
//
// Thread safety: any thread.
#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <mutex>
#include <optional>
#include <string>
#include <utility>

#include "shm/activity.hpp"

namespace arbiter::gateway::dds {

class Repeats {
 public:
  explicit Repeats(shm::Nanoseconds period) noexcept : period_(period) {}

  // Empty: it was said within the period. Otherwise how often it was not said since the last time.
  [[nodiscard]] std::optional<std::uint64_t> take(const std::string& text, shm::Nanoseconds now) {
    const std::lock_guard lock(mutex_);
    const auto found = std::find_if(said_.begin(), said_.end(),
                                    [&](const Said& each) { return each.text == text; });
    if (found == said_.end()) {
      Said& oldest = *std::min_element(
          said_.begin(), said_.end(), [](const Said& a, const Said& b) { return a.last < b.last; });
      oldest = {text, now, 0};
      return 0;
    }
    if (now - found->last < period_) {
      ++found->left_out;
      return std::nullopt;
    }
    found->last = now;
    return std::exchange(found->left_out, 0);
  }

 private:
  struct Said {
    std::string text;
    shm::Nanoseconds last = 0;
    std::uint64_t left_out = 0;
  };

  const shm::Nanoseconds period_;
  std::mutex mutex_;
  std::array<Said, 16> said_;  // those that were said last
};

}  // namespace arbiter::gateway::dds
