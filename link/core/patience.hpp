// What one look at things may spend on calls that wait for others: for the daemon, which opens
// ports and taps, and for readers, which are to acknowledge before a writer ends. One that is
// stopped answers none of them, and each one waits: after one of these the others have their turn
// at later looks, so that the loop goes round.
//
// Thread safety: none of its own.
#pragma once

#include <functional>
#include <utility>

#include "shm/activity.hpp"

namespace arbiter::link {

class Patience {
 public:
  // In nanoseconds: less than a call waits that is not answered.
  static constexpr shm::Nanoseconds kMost = 150'000'000;

  // `clock` is monotonic; `waited` is called after each call.
  Patience(std::function<shm::Nanoseconds()> clock, std::function<void()> waited)
      : clock_(std::move(clock)), waited_(std::move(waited)), began_(clock_()) {}

  // False: at the next look.
  [[nodiscard]] bool is_left() const { return clock_() - began_ < kMost; }
  // After each call that may have waited.
  void note_call() const { waited_(); }

 private:
  const std::function<shm::Nanoseconds()> clock_;
  const std::function<void()> waited_;
  const shm::Nanoseconds began_;
};

}  // namespace arbiter::link
