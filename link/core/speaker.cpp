#include "link/core/speaker.hpp"

#include <algorithm>
#include <utility>

namespace arbiter::link {

void Speaker::add(Offerer offerer) {
  const auto is_same = [&](const Offerer& each) { return each.key == offerer.key; };
  if (std::any_of(offerers_.begin(), offerers_.end(), is_same)) return;
  const Offerer* const now = current();
  const bool takes_over =
      now == nullptr || (now->host == offerer.host && now->incarnation != offerer.incarnation);
  if (takes_over) current_ = offerer.key;
  offerers_.push_back(std::move(offerer));
}

void Speaker::remove(std::uint64_t key) {
  const auto gone = std::find_if(offerers_.begin(), offerers_.end(),
                                 [&](const Offerer& each) { return each.key == key; });
  if (gone == offerers_.end()) return;
  offerers_.erase(gone);
  if (key == current_) choose();
}

// The same one on all hosts that see the same offers, so that it can be foretold.
void Speaker::choose() {
  const auto first =
      std::min_element(offerers_.begin(), offerers_.end(),
                       [](const Offerer& a, const Offerer& b) { return a.host < b.host; });
  if (first == offerers_.end()) return;
  current_ = first->key;
  // Of its lives the last.
  for (const Offerer& each : offerers_) {
    if (each.host == first->host) current_ = each.key;
  }
}

const Offerer* Speaker::current() const noexcept {
  for (const Offerer& each : offerers_) {
    if (each.key == current_) return &each;
  }
  return nullptr;
}

std::vector<std::string> Speaker::hosts() const {
  std::vector<std::string> hosts;
  for (const Offerer& each : offerers_) hosts.push_back(each.host);
  std::sort(hosts.begin(), hosts.end());
  hosts.erase(std::unique(hosts.begin(), hosts.end()), hosts.end());
  return hosts;
}

}  // namespace arbiter::link
