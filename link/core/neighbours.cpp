#include "link/core/neighbours.hpp"

#include <algorithm>
#include <set>
#include <string_view>
#include <tuple>
#include <utility>

namespace arbiter::link {
namespace {

std::size_t names_in(const Neighbour& neighbour) {
  return neighbour.card->inputs.size() + neighbour.card->outputs.size();
}

}  // namespace

bool Neighbours::note(std::uint64_t key, HostCard card, shm::Nanoseconds now,
                      const Participant& participant) {
  ++changes_;
  // A host that has come back, with the same life or another, is not gone any more.
  gone_unlisted_.erase(card.host);
  std::erase_if(all_,
                [&](const Neighbour& each) { return !each.is_up && each.card->host == card.host; });
  const auto known = std::find_if(all_.begin(), all_.end(),
                                  [&](const Neighbour& each) { return each.key == key; });
  if (known != all_.end()) {
    if (known->card->incarnation != card.incarnation) known->since = now;
    known->card = std::make_shared<const HostCard>(std::move(card));
    known->heard = now;
    known->participant = participant;
    bound_names();
    put_in_order();
    return true;
  }
  if (!make_place()) {
    turn_away(key, card.host, now, participant);
    return false;
  }
  turned_away_.erase(key);
  all_.push_back(
      {key, std::make_shared<const HostCard>(std::move(card)), true, now, now, participant});
  bound_names();
  put_in_order();
  return true;
}

// Where one that is gone gives way: the one that has been so for the longest time.
bool Neighbours::make_place() {
  if (all_.size() < kMost) return true;
  const auto longest_gone =
      std::min_element(all_.begin(), all_.end(), [](const Neighbour& a, const Neighbour& b) {
        return std::tuple(a.is_up, a.since) < std::tuple(b.is_up, b.since);
      });
  if (longest_gone->is_up) return false;
  remember(longest_gone->card->host, longest_gone->since);
  all_.erase(longest_gone);
  return true;
}

void Neighbours::turn_away(std::uint64_t key, const std::string& host, shm::Nanoseconds now,
                           const Participant& participant) {
  if (turned_away_.size() < kMostWithoutPlace || turned_away_.contains(key)) {
    turned_away_[key] = {host, now, participant};
  }
}

void Neighbours::remember(const std::string& host, shm::Nanoseconds gone_since) {
  if (gone_unlisted_.size() < kMostWithoutPlace || gone_unlisted_.contains(host)) {
    gone_unlisted_[host] = gone_since;
  }
}

void Neighbours::keep(std::vector<std::uint64_t> keys, shm::Nanoseconds then,
                      const std::optional<std::set<Participant>>& pulsing) {
  const std::uint64_t before = changes_;
  std::sort(keys.begin(), keys.end());
  const IsThere is_there = [&](std::uint64_t key, shm::Nanoseconds heard, const Participant& from) {
    if (heard >= then) return true;
    const bool may_pulse = !pulsing || pulsing->contains(from) || then - heard < kUnheard;
    return may_pulse && std::binary_search(keys.begin(), keys.end(), key);
  };
  for (Neighbour& each : all_) {
    if (!each.is_up || is_there(each.key, each.heard, each.participant)) continue;
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
  keep_count(is_there, then);
  if (changes_ != before) put_in_order();
}

// As for those that have a place.
void Neighbours::keep_count(const IsThere& is_there, shm::Nanoseconds then) {
  std::erase_if(turned_away_, [&](const auto& each) {
    const auto& [key, card] = each;
    if (is_there(key, card.heard, card.participant)) return false;
    remember(card.host, then);
    return true;
  });
  std::set<std::string_view> up;
  for (const Neighbour& each : all_) {
    if (each.is_up) up.insert(each.card->host);
  }
  for (const auto& [key, card] : turned_away_) up.insert(card.host);
  std::erase_if(gone_unlisted_, [&](const auto& each) {
    return then - each.second >= kRemembered || up.contains(each.first);
  });
}

void Neighbours::bound_names() {
  std::size_t names = 0;
  for (const Neighbour& each : all_) names += names_in(each);
  while (names > kMostNames) {
    const auto most = std::max_element(
        all_.begin(), all_.end(),
        [](const Neighbour& a, const Neighbour& b) { return names_in(a) < names_in(b); });
    names -= names_in(*most);
    HostCard without = *most->card;
    without.inputs = {};
    without.outputs = {};
    most->card = std::make_shared<const HostCard>(std::move(without));
  }
}

void Neighbours::put_in_order() {
  std::sort(all_.begin(), all_.end(), [](const Neighbour& a, const Neighbour& b) {
    return std::tuple(!a.is_up, std::string_view(a.card->host), a.since, a.key) <
           std::tuple(!b.is_up, std::string_view(b.card->host), b.since, b.key);
  });
}

}  // namespace arbiter::link
