#include "gateway/core/turned_away.hpp"

#include <unistd.h>

#include <algorithm>

namespace arbiter::gateway {
namespace {

constexpr shm::Nanoseconds kStaysUnknown = 2'000'000'000;

}  // namespace

std::optional<shm::Nanoseconds> turned_away_at(const wire::Status& status, std::string_view node) {
  std::optional<shm::Nanoseconds> last;
  for (const wire::StrangerStatus& each : status.strangers) {
    const bool is_ours = each.pid == ::getpid() && each.node == node;
    if (is_ours && each.seen - each.since >= kStaysUnknown) {
      last = std::max(last, std::optional<shm::Nanoseconds>(each.seen));
    }
  }
  return last;
}

}  // namespace arbiter::gateway
