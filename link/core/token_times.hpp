// When tokens were sent, or when they came: exact for the last ones, ever coarser for earlier ones,
// in memory that does not grow.
//
// Tokens are numbered from 1 upwards. Level 0 keeps the last 64, level 1 the last 64 whose numbers
// are multiples of 8, level 2 those of 64, and so on. So what is known of a token that lies some
// time back is off by an eighth of that time at most, if tokens come regularly, and always in the
// direction that makes samples older than they are: that is safe (docs/hosts.md).
//
// Thread safety: none of its own.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>

#include "shm/activity.hpp"

namespace arbiter::link {

class TokenTimes {
 public:
  // Ignores a number that is not larger than all before.
  void note(std::uint64_t number, shm::Nanoseconds time) noexcept;

  // 0: there was none.
  [[nodiscard]] std::uint64_t last() const noexcept { return last_; }
  // A time at which the token had not yet been noted, or at which it was. Nothing: a number that
  // was never noted, or lies further back than anything that is kept.
  [[nodiscard]] std::optional<shm::Nanoseconds> time_of(std::uint64_t number) const noexcept;
  // The newest token that is known to have been noted at `time` or before; 0: none is.
  [[nodiscard]] std::uint64_t newest_by(shm::Nanoseconds time) const noexcept;

 private:
  static constexpr std::size_t kEntries = 64;  // of a level
  static constexpr std::uint64_t kStep = 8;
  static constexpr std::size_t kLevels = 9;  // 64 · 8^8 tokens: 12 days, of one each millisecond
  struct Entry {
    std::uint64_t number = 0;  // 0: none
    shm::Nanoseconds time = 0;
  };
  using Level = std::array<Entry, kEntries>;

  std::array<Level, kLevels> levels_{};
  std::uint64_t last_ = 0;
};

}  // namespace arbiter::link
