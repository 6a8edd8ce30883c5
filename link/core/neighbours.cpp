#include "link/core/neighbours.hpp"

#include <algorithm>
#include <set>
#include <string_view>
#include <tuple>
#include <utility>

namespace arbiter::link {

bool Neighbours::note(std::uint64_t key, HostCard card, shm::Nanoseconds now) {
  ++changes_;
  // A host that has come back, with the same life or another, is not gone any more.
  std::erase_if(all_,
                [&](const Neighbour& each) { return !each.is_up && each.card->host == card.host; });
  const auto known = std::find_if(all_.begin(), all_.end(),
                                  [&](const Neighbour& each) { return each.key == key; });
  if (known != all_.end()) {
    if (known->card->incarnation != card.incarnation) known->since = now;
    known->card = std::make_shared<const HostCard>(std::move(card));
    known->heard = now;
    put_in_order();
    return true;
  }
  if (all_.size() >= kMost) {
    const auto gone =
        std::find_if(all_.begin(), all_.end(), [](const Neighbour& each) { return !each.is_up; });
    if (gone == all_.end()) return false;
    all_.erase(gone);
  }
  all_.push_back({key, std::make_shared<const HostCard>(std::move(card)), true, now, now});
  put_in_order();
  return true;
}

void Neighbours::keep(std::vector<std::uint64_t> keys, shm::Nanoseconds then) {
  const std::uint64_t before = changes_;
  std::sort(keys.begin(), keys.end());
  for (Neighbour& each : all_) {
    if (!each.is_up || each.heard >= then) continue;
    if (std::binary_search(keys.begin(), keys.end(), each.key)) continue;
    each.is_up = false;
    each.key = 0;
    each.since = then;
    ++changes_;
  }
  std::set<std::string_view> up;
  for (const Neighbour& each : all_) {
    if (each.is_up) up.insert(each.card->host);
  }
  changes_ += std::erase_if(all_, [&](const Neighbour& each) {
    // The later: its next life is here already.
    return !each.is_up && (then - each.since >= kRemembered || up.contains(each.card->host));
  });
  if (changes_ != before) put_in_order();
}

void Neighbours::put_in_order() {
  std::sort(all_.begin(), all_.end(), [](const Neighbour& a, const Neighbour& b) {
    return std::tuple(!a.is_up, std::string_view(a.card->host), a.since, a.key) <
           std::tuple(!b.is_up, std::string_view(b.card->host), b.since, b.key);
  });
}

}  // namespace arbiter::link
