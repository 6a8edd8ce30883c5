#include "cli/recorded_components.hpp"

#include <algorithm>

namespace arbiter::cli {

// One component has it open at a time. Looks come one after the other, but the deaths that one of
// them shows come with the latest first.
Owners::Owners(const std::vector<evidence::PortChange>& changes) : changes_(changes.data()) {
  using What = evidence::PortChange::What;
  std::size_t open = 0;  // behind the one that is open; 0: none is
  shm::Nanoseconds now = 0;
  for (const evidence::PortChange& each : changes) {
    now = std::max(now, each.seen);
    const bool is_opening = each.what == What::open || each.what == What::opened;
    const bool ends_open = open != 0 && (is_opening || all_[open - 1].opening->pid == each.pid);
    if (ends_open) {
      all_[open - 1].until = now;
      open = 0;
    }
    if (is_opening) open = all_.size() + 1;
    // One that nobody saw open may have died all the same.
    if (is_opening || (!ends_open && each.what == What::died)) {
      all_.push_back({&each, now, is_opening ? shm::kForever : now});
    }
    seen_.push_back(each.seen);
  }
  for (std::size_t i = 1; i < all_.size(); ++i) {
    all_[i].until = std::max(all_[i].until, all_[i - 1].until);
  }
  for (std::size_t i = seen_.size(); i-- > 1;) seen_[i - 1] = std::min(seen_[i - 1], seen_[i]);
}

Publishers Owners::of(const Reign& reign) const {
  const evidence::WinnerChange& change = reign.change;
  const bool begins_itself =
      change.why == evidence::WinnerChange::Why::arrival && change.by == change.winner;
  const auto first_from = [&](shm::Nanoseconds Ownership::*field, shm::Nanoseconds time) {
    const auto is_before = [&](const Ownership& one) { return one.*field < time; };
    return static_cast<std::size_t>(std::partition_point(all_.begin(), all_.end(), is_before) -
                                    all_.begin());
  };
  const std::size_t first = first_from(&Ownership::until, change.time + 1);
  std::size_t next = first_from(&Ownership::since, change.time + 1);
  const std::size_t end = first_from(&Ownership::since, reign.end);
  const bool has_first = first < all_.size() && (first < end || begins_itself);
  Publishers found;
  // Who had closed it before it arrived is not who let it arrive.
  if (first != 0 && !begins_itself && (!has_first || first >= next)) {
    found.first.push_back(all_[first - 1].opening);
  }
  if (has_first) found.first.push_back(all_[first].opening);
  for (next = std::max(next, first + 1); next < end; ++next) {
    if (found.first.size() == kMostComponents) {
      found.others = end - next;
      break;
    }
    found.first.push_back(all_[next].opening);
  }
  return found;
}

const evidence::PortChange* Owners::last_by(shm::Nanoseconds time) const {
  const auto behind = std::upper_bound(seen_.begin(), seen_.end(), time) - seen_.begin();
  return behind == 0 ? nullptr : changes_ + behind - 1;
}

}  // namespace arbiter::cli
