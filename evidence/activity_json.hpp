// Activities as records write them: a kind, and a time.
#pragma once

#include <optional>
#include <string_view>

#include "shm/activity.hpp"

namespace arbiter::evidence {

// never:       0
// until:       when it ends
// forever:     since when it lasts
// deactivated: when
struct WrittenActivity {
  std::string_view kind;
  shm::Nanoseconds time = 0;
};

[[nodiscard]] constexpr WrittenActivity written(shm::ActivityWord word) noexcept {
  if (word == shm::kNeverActive) return {"never", 0};
  if (word < 0) return {"deactivated", word & ~shm::kDeactivatedFlag};
  if (word >= shm::kForeverFlag) return {"forever", word & ~shm::kForeverFlag};
  return {"until", word};
}

// Nothing: it is none.
[[nodiscard]] constexpr std::optional<shm::ActivityWord> activity_of(std::string_view kind,
                                                                     shm::Nanoseconds time) {
  if (time < 0 || time >= shm::kForeverFlag) return std::nullopt;
  if (kind == "never") return shm::kNeverActive;
  if (kind == "until") return time;
  if (kind == "forever") return shm::kForeverFlag | time;
  if (kind == "deactivated") return shm::deactivation(time);
  return std::nullopt;
}

}  // namespace arbiter::evidence
