#include "link/core/stream.hpp"

#include <algorithm>

namespace arbiter::link {

bool Stream::note(Incarnation from, std::uint64_t number, bool deactivated) noexcept {
  if (exporters_.front().incarnation != from) {
    move_to_front(from);
    has_begun_ = false;
  }
  Exporter& exporter = exporters_.front();
  if (number <= exporter.last) {
    ++doubled_;
    return false;
  }
  if (has_begun_) lost_ += number - exporter.last - 1;
  has_begun_ = true;
  exporter.last = number;
  deactivated_ = deactivated;
  return true;
}

// In the place of the one that has not been obeyed for the longest time, where it is not among
// them.
void Stream::move_to_front(Incarnation from) noexcept {
  auto found = std::find_if(exporters_.begin(), exporters_.end(),
                            [&](const Exporter& each) { return each.incarnation == from; });
  if (found == exporters_.end()) {
    found = exporters_.end() - 1;
    *found = {from, 0};
  }
  std::rotate(exporters_.begin(), found, found + 1);
}

}  // namespace arbiter::link
