// How often a source arrives, judged by looking at its activity word now and then.
//
// A publisher that is slower than its source's T makes the source inactive between any two of its
// arrivals, so the port that it commands changes hands each time. No counter shows it: each arrival
// is as good as any other.
#pragma once

#include <optional>
#include <string>

#include "shm/activity.hpp"

namespace arbiter::watch {

// How often to look. Of a source whose T is shorter than two looks, arrivals would be missed.
inline constexpr shm::Nanoseconds kPaceLook = 10'000'000;
inline constexpr shm::Nanoseconds kLeastPacedTimeout = 2 * kPaceLook;

class Pace {
 public:
  // What the source's word was at `now`, and its T. Times do not fall.
  void look(shm::ActivityWord word, shm::Nanoseconds timeout, shm::Nanoseconds now);

  // How far its arrivals are apart, if that is more than T: each of the last two came when T had
  // passed, and after about the same time. A source that speaks when something happens, as a
  // button does, keeps no such time.
  [[nodiscard]] std::optional<shm::Nanoseconds> slow_period() const;
  // The last two arrivals both came in time, or neither did: no more need be seen.
  [[nodiscard]] bool is_known() const { return in_time_ >= 2 || slow_period().has_value(); }

 private:
  void start_again(shm::ActivityWord word, shm::Nanoseconds timeout);

  shm::ActivityWord word_ = shm::kNeverActive;
  shm::Nanoseconds timeout_ = 0;
  bool has_passed_ = false;  // T had, when the word was last looked at
  int in_time_ = 0;          // arrivals in time, one after the other
  // Between the last arrivals that came late; 0: none, or the one before came in time.
  shm::Nanoseconds gap_ = 0;
  shm::Nanoseconds gap_before_ = 0;
};

// "/Nav/cmd:o publishes every 250 ms, and its T is 100 ms", and what follows from that.
[[nodiscard]] std::string slow_text(const std::string& source, shm::Nanoseconds period,
                                    shm::Nanoseconds timeout);

}  // namespace arbiter::watch
