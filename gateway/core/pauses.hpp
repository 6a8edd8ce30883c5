// When something may be said again that strangers can change for ever: ever later, while they do.
//
// Thread safety: one thread.
#pragma once

#include <algorithm>
#include <string>

#include "shm/activity.hpp"

namespace arbiter::gateway {

class Pauses {
 public:
  static constexpr shm::Nanoseconds kShortest = 1'000'000'000;
  static constexpr shm::Nanoseconds kLongest = 60 * kShortest;

  [[nodiscard]] bool is_over(shm::Nanoseconds now) const noexcept { return now >= until_; }
  // It is said now.
  void begin(shm::Nanoseconds now) noexcept {
    const bool was_calm = now - until_ > kLongest;
    length_ = was_calm ? kShortest : std::min(length_ + length_ / 4, kLongest);
    until_ = now + length_;
  }

 private:
  shm::Nanoseconds length_ = kShortest;
  shm::Nanoseconds until_ = 0;
};

// What is said when it has changed, with such pauses.
class News {
 public:
  // True: it is said now. Otherwise it was said last, or is to be asked about later.
  [[nodiscard]] bool take(const std::string& text, shm::Nanoseconds now) {
    if (text == said_ || !pauses_.is_over(now)) return false;
    said_ = text;
    if (text.empty()) return false;
    pauses_.begin(now);
    return true;
  }

 private:
  std::string said_;
  Pauses pauses_;
};

}  // namespace arbiter::gateway
