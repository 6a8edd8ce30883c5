// The tokens that a link sends to the links from which it imports, and how old a sample can be that
// names one of them.
//
// A sample that names token k was published after k had come to its host, so after k was sent. No
// clock of another host is asked. With a token at least every T/8, which is more than is needed, a
// sample that is younger than T/2 is in time if a round trip takes no more than T/4:
//
//   T/2 its age + T/4 the token's way + T/8 until the next token + T/8 what TokenTimes leaves open
//
// Units: nanoseconds of a clock that also counts while the machine sleeps (CLOCK_BOOTTIME), given
// by the caller.
//
// Thread safety: any thread.
#pragma once

#include <cstdint>
#include <mutex>
#include <optional>

#include "link/core/token_times.hpp"
#include "shm/activity.hpp"

namespace arbiter::link {

// How often tokens are sent where the shortest T of an imported source is this.
[[nodiscard]] shm::Nanoseconds token_period(shm::Nanoseconds shortest) noexcept;

class SentTokens {
 public:
  // The next token, which is sent after this call. Numbers begin at 1.
  std::uint64_t next(shm::Nanoseconds now);

  // For how long a sample that names it may still arrive, if it may be `max_age` old at most; below
  // 0: it is late. A token that was never sent is no evidence: late.
  [[nodiscard]] shm::Nanoseconds time_left(std::uint64_t token, shm::Nanoseconds max_age,
                                           shm::Nanoseconds now) const;

 private:
  mutable std::mutex mutex_;
  TokenTimes times_;
};

}  // namespace arbiter::link
