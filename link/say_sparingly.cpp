#include "link/say_sparingly.hpp"

#include "gateway/dds/quota.hpp"
#include "shm/clock.hpp"

namespace arbiter::link {
namespace {

// Enough for a model's sources that are found at once, and no more than one a second in the long
// run.
constexpr std::uint32_t kMost = 100;
constexpr shm::Nanoseconds kWithin = 100'000'000'000;

gateway::dds::Quota& quota_of(gateway::Level level) {
  using gateway::dds::Quota;
  static Quota& information = *new Quota(kMost, kWithin);
  static Quota& wrongs = *new Quota(kMost, kWithin);
  return level == gateway::Level::kInfo ? information : wrongs;
}

}  // namespace

bool say_sparingly(gateway::Level level, const std::string& text) {
  const auto left_out = quota_of(level).take();
  if (!left_out) return false;
  gateway::say(level, *left_out == 0
                          ? text
                          : text + " (" + std::to_string(*left_out) + " messages left out before)");
  return true;
}

bool say_sooner_or_later(gateway::Level level, const std::string& text) {
  const bool is_said = quota_of(level).take_without_count(shm::monotonic_now());
  if (is_said) gateway::say(level, text);
  return is_said;
}

}  // namespace arbiter::link
