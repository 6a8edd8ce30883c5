// How fast large samples leave.
//
// Nothing in UDP holds up a sender whose receiver is slower: what does not fit the buffer of the
// receiver's socket is gone, and DDS has to repeat it. Alone, datagrams cost their sender more than
// their receiver; in trains (dds/datagram_train.hpp) it is the other way round. So trains leave at
// a pace, which is lowered while something has to be repeated and raised by and by while nothing
// has.
//
// Invariant: from any moment on, what leaves in a time t is at most kBurst and t times the pace.
//
// Thread safety: one thread at a time. Time is given.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>

#include "shm/activity.hpp"

namespace arbiter::link {

class TrainPace {
 public:
  // Bytes a second. The slowest is what single datagrams reach, so that nobody who has things
  // repeated for nothing makes a link slower than it would be without trains.
  static constexpr double kSlowest = 150e6;
  static constexpr double kFirst = 400e6;
  static constexpr double kFastest = 2e9;
  static constexpr double kBurst = 128 * 1024;  // bytes that leave without waiting
  // What is repeated within that time after the pace was lowered was lost before.
  static constexpr shm::Nanoseconds kSettles = 10'000'000;
  static constexpr double kDoublesWithin = 256e6;  // bytes

  // `repeated`: as leave() has it, before anything leaves.
  explicit TrainPace(std::uint64_t repeated = 0) noexcept : repeated_(repeated) {}

  // `bytes` leave now; `repeated`: how many datagrams have been repeated so far. How long what
  // follows has to wait.
  [[nodiscard]] shm::Nanoseconds leave(std::size_t bytes, std::uint64_t repeated,
                                       shm::Nanoseconds now) noexcept {
    if (repeated != repeated_ && now - lowered_ >= kSettles) {
      lowered_ = now;
      pace_ = std::max(pace_ * 0.7, kSlowest);
    } else if (repeated == repeated_) {
      pace_ = std::min(pace_ * (1 + static_cast<double>(bytes) / kDoublesWithin), kFastest);
    }
    repeated_ = repeated;
    gone_ = std::max(gone_, now) + in_time(static_cast<double>(bytes));
    return std::max<shm::Nanoseconds>(gone_ - now - in_time(kBurst), 0);
  }
  [[nodiscard]] double pace() const noexcept { return pace_; }

 private:
  [[nodiscard]] shm::Nanoseconds in_time(double bytes) const noexcept {
    return static_cast<shm::Nanoseconds>(bytes / pace_ * 1e9);
  }

  double pace_ = kFirst;
  shm::Nanoseconds gone_ = 0;  // when all that has left would have left at that pace
  shm::Nanoseconds lowered_ = 0;
  std::uint64_t repeated_;
};

}  // namespace arbiter::link
