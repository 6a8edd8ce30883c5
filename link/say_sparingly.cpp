#include "link/say_sparingly.hpp"

#include "gateway/dds/quota.hpp"

namespace arbiter::link {
namespace {

// Enough for a model's sources that are found at once, and no more than one a second in the long
// run.
constexpr std::uint32_t kMost = 100;
constexpr shm::Nanoseconds kWithin = 100'000'000'000;

}  // namespace

bool say_sparingly(gateway::Level level, const std::string& text) {
  static gateway::dds::Quota& quota = *new gateway::dds::Quota(kMost, kWithin);
  const auto left_out = quota.take();
  if (!left_out) return false;
  gateway::say(level, *left_out == 0
                          ? text
                          : text + " (" + std::to_string(*left_out) + " messages left out before)");
  return true;
}

}  // namespace arbiter::link
