#include "watch/pace.hpp"

#include <algorithm>
#include <utility>

#include "watch/span.hpp"

namespace arbiter::watch {

void Pace::start_again(shm::ActivityWord word, shm::Nanoseconds timeout) {
  *this = {};
  word_ = word;
  timeout_ = timeout;
}

void Pace::look(shm::ActivityWord word, shm::Nanoseconds timeout, shm::Nanoseconds now) {
  const bool tells_arrival =
      shm::is_finite(word) && word != shm::kNeverActive && timeout >= kLeastPacedTimeout;
  if (!tells_arrival || timeout != timeout_ || !shm::is_finite(word_)) {
    start_again(word, timeout);
  } else if (word != word_ && word_ != shm::kNeverActive) {
    gap_before_ = std::exchange(gap_, has_passed_ ? word - word_ : 0);
    in_time_ = has_passed_ ? 0 : in_time_ + 1;
  }
  word_ = word;
  has_passed_ = !shm::is_active(word, now);
}

std::optional<shm::Nanoseconds> Pace::slow_period() const {
  if (gap_ == 0 || gap_before_ == 0) return std::nullopt;
  const shm::Nanoseconds longer = std::max(gap_, gap_before_);
  if (longer - std::min(gap_, gap_before_) > longer / 4) return std::nullopt;
  return (gap_ + gap_before_) / 2;
}

std::string slow_text(const std::string& source, shm::Nanoseconds period,
                      shm::Nanoseconds timeout) {
  return source + " publishes every " + span_text(period) + ", and its T is " + span_text(timeout) +
         ": it is inactive in between";
}

}  // namespace arbiter::watch
