#include "cast.hpp"

#include <limits>

namespace hosts_demo {
namespace {

constexpr double kNoEnd = std::numeric_limits<double>::infinity();

bool commands(const Reigns& reigns, std::string_view source, Interval when) {
  for (std::size_t i = 0; i < reigns.size(); ++i) {
    const double until = i + 1 < reigns.size() ? reigns[i + 1].since : kNoEnd;
    if (reigns[i].source == source && reigns[i].since < when.to && until > when.from) return true;
  }
  return false;
}

}  // namespace

bool is_as_the_page_says(const Reigns& arm, double pace) {
  const Interval cut{kCable.from + kAfterT / pace, kCable.to};
  const Interval dead{kLink.from + kAfterT / pace, kLink.to};
  return commands(arm, kRestPort, {0, kObject.from}) &&
         commands(arm, kObjectPort, {kObject.from, kCable.from}) && commands(arm, kRestPort, cut) &&
         !commands(arm, kObjectPort, cut) && commands(arm, kObjectPort, {kCable.to, kLink.from}) &&
         commands(arm, kRestPort, dead) && !commands(arm, kObjectPort, dead) &&
         commands(arm, kObjectPort, {kLink.to, kObject.to}) &&
         commands(arm, kRestPort, {kObject.to, kNoEnd});
}

}  // namespace hosts_demo
