#include "link/core/sent_tokens.hpp"

#include <algorithm>

namespace arbiter::link {
namespace {

// However short T is: more often would cost more than it is worth. A T below 8 ms may call a fresh
// sample late.
constexpr shm::Nanoseconds kShortest = 1'000'000;
// However long: so that others see soon that a source is imported here.
constexpr shm::Nanoseconds kLongest = 250'000'000;
constexpr shm::Nanoseconds kLate = -1;

}  // namespace

shm::Nanoseconds token_period(shm::Nanoseconds shortest) noexcept {
  return std::clamp(shortest / 8, kShortest, kLongest);
}

std::uint64_t SentTokens::next(shm::Nanoseconds now) {
  const std::lock_guard lock(mutex_);
  const std::uint64_t number = times_.last() + 1;
  times_.note(number, now);
  return number;
}

shm::Nanoseconds SentTokens::time_left(std::uint64_t token, shm::Nanoseconds max_age,
                                       shm::Nanoseconds now) const {
  const std::lock_guard lock(mutex_);
  const std::optional<shm::Nanoseconds> sent = times_.time_of(token);
  if (!sent || *sent > now) return kLate;
  return std::max(max_age - (now - *sent), kLate);
}

}  // namespace arbiter::link
