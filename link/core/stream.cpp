#include "link/core/stream.hpp"

#include <algorithm>

namespace arbiter::link {

void Stream::obey(Incarnation exporter) noexcept {
  if (exporters_.front().incarnation == exporter) return;
  move_to_front(exporter);
  has_begun_ = false;
}

bool Stream::note(Incarnation from, const StreamEvent& event) noexcept {
  obey(from);
  Exporter& exporter = exporters_.front();
  if (event.number <= exporter.last) {
    ++doubled_;
    return false;
  }
  if (has_begun_) lost_ += std::min(missed(exporter, event), ~lost_);  // it never begins again
  has_begun_ = has_begun_ || !event.is_unasked;
  exporter.last = event.number;
  exporter.sequence = event.sequence;
  if (event.is_deactivated != exporter.is_deactivated) exporter.is_end_due = event.is_deactivated;
  exporter.is_deactivated = event.is_deactivated;
  // A signal that follows leaves it what it was: the newest sample.
  if (event.has_sample || event.is_deactivated) exporter.is_awaited = event.is_withheld;
  return true;
}

bool Stream::completes(Incarnation from, std::uint64_t number) noexcept {
  Exporter& exporter = exporters_.front();
  if (exporter.incarnation != from || exporter.last != number || !exporter.is_awaited) return false;
  exporter.is_awaited = false;
  return true;
}

// A successor of the publisher counts from 1 again. An exporter that has only joined does not know
// yet how far its publisher is: what was published before is not missed.
std::uint64_t Stream::missed(const Exporter& exporter, const StreamEvent& event) noexcept {
  const std::uint64_t events = event.number - exporter.last - 1;
  if (exporter.sequence == 0 || event.sequence <= exporter.sequence) return events;
  return std::max(events, event.sequence - exporter.sequence - (event.has_sample ? 1 : 0));
}

// In the place of the one that has not been obeyed for the longest time, where it is not among
// them.
void Stream::move_to_front(Incarnation from) noexcept {
  auto found = std::find_if(exporters_.begin(), exporters_.end(),
                            [&](const Exporter& each) { return each.incarnation == from; });
  if (found == exporters_.end()) {
    found = exporters_.end() - 1;
    *found = Exporter{};
    found->incarnation = from;
  }
  std::rotate(exporters_.begin(), found, found + 1);
}

}  // namespace arbiter::link
