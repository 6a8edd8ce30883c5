#include "watch/sources.hpp"

namespace arbiter::watch {

// The word gives the end; the arrival follows from the T that was in force then.
std::optional<shm::Nanoseconds> SourceState::last_arrival() const {
  if (word == shm::kNeverActive || shm::is_deactivation(word)) return std::nullopt;
  if (timeout_before && shm::is_finite(word)) {
    const bool has_stood = word == word_at_change;
    if (has_stood || timeout == shm::kForever || word - timeout < timeout_changed) {
      return std::nullopt;
    }
  }
  return shm::arrival_of(word, timeout);
}

std::optional<shm::Nanoseconds> SourceState::arrived_by() const {
  if (!timeout_before || !shm::is_finite(word) || word == shm::kNeverActive) return std::nullopt;
  return last_arrival() ? std::nullopt : std::optional(timeout_changed);
}

shm::Nanoseconds event_time(const SourceState& state, shm::Nanoseconds now) {
  if (state.began == now) return now;
  if (shm::is_deactivation(state.word)) return state.word & ~shm::kDeactivatedFlag;
  if (shm::is_active(state.word, now)) {
    return state.began ? *state.began : state.last_arrival().value_or(now);
  }
  return state.word;
}

}  // namespace arbiter::watch
