#include "link/core/token_times.hpp"

namespace arbiter::link {

void TokenTimes::note(std::uint64_t number, shm::Nanoseconds time) noexcept {
  if (number <= last_) return;
  last_ = number;
  std::uint64_t nth = number;  // of those that the level keeps
  for (Level& level : levels_) {
    level[nth % kEntries] = {number, time};
    if (nth % kStep != 0) return;
    nth /= kStep;
  }
}

std::optional<shm::Nanoseconds> TokenTimes::time_of(std::uint64_t number) const noexcept {
  if (number == 0 || number > last_) return std::nullopt;
  std::uint64_t nth = number;
  std::uint64_t kept = number;  // the last one, up to this, that the level keeps
  std::uint64_t distance = 1;
  for (const Level& level : levels_) {
    const Entry& entry = level[nth % kEntries];
    if (nth != 0 && entry.number == kept) return entry.time;
    nth /= kStep;
    distance *= kStep;
    kept = nth * distance;
  }
  return std::nullopt;
}

std::uint64_t TokenTimes::newest_by(shm::Nanoseconds time) const noexcept {
  std::uint64_t distance = 1;
  for (const Level& level : levels_) {
    std::uint64_t newest = 0;
    const std::uint64_t nth = last_ / distance;
    for (std::size_t back = 0; back < kEntries && back < nth; ++back) {
      const Entry& entry = level[(nth - back) % kEntries];
      // Numbers may be missing, and older ones stand in their places.
      if (entry.time <= time && entry.number > newest) newest = entry.number;
      if (newest == (nth - back) * distance) break;
    }
    if (newest != 0) return newest;
    distance *= kStep;
  }
  return 0;
}

}  // namespace arbiter::link
