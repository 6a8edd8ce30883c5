#include "link/core/offers.hpp"

#include <algorithm>
#include <string_view>
#include <utility>

namespace arbiter::link {

void Offers::look(const std::vector<Offer>& offers, const OtherLinks& others,
                  shm::Nanoseconds now) {
  std::set<std::uint64_t> there;
  for (const Offer& offer : offers) {
    // A deaf one sends nothing any more, and would be waited for as long as its announcements come.
    if (offer.card.source != source_ || others.deaf.contains(offer.participant)) continue;
    there.insert(offer.key);
  }
  find_newest(offers);
  for (auto each = seen_.begin(); each != seen_.end();) {
    const bool is_there = there.contains(each->first);
    if (!is_there) speaker_.remove(each->first);
    each = is_there ? std::next(each) : seen_.erase(each);
  }
  for (const Offer& offer : offers) {
    if (!there.contains(offer.key)) continue;
    Seen& seen = seen_[offer.key];
    if (seen.since == 0) seen.since = now;
    seen.offer = offer;
    judge(seen, others, now);
    if (seen.is_over) {
      speaker_.remove(offer.key);
    } else {
      speaker_.add({offer.key, offer.card.host, offer.card.incarnation});
    }
  }
  find_shared_name(now);
}

// The newest one may end while an older one still stands.
void Offers::find_newest(const std::vector<Offer>& offers) {
  std::map<Participant, Incarnation> newest;
  for (const Offer& offer : offers) {
    if (offer.card.source != source_) continue;
    Incarnation& its = newest.emplace(offer.participant, offer.card.incarnation).first->second;
    const auto known = newest_.find(offer.participant);
    if (known != newest_.end() && is_newer(known->second, its)) its = known->second;
    if (is_newer(offer.card.incarnation, its)) its = offer.card.incarnation;
  }
  newest_.swap(newest);
}

void Offers::judge(Seen& seen, const OtherLinks& others, shm::Nanoseconds now) const {
  const auto found = others.cards.find(seen.offer.participant);
  // Of a host that has more ports open than find a place, or has not said anything, it is not
  // known.
  const bool is_named =
      found == others.cards.end() || found->second->output_count != found->second->outputs.size() ||
      std::binary_search(found->second->outputs.begin(), found->second->outputs.end(), source_);
  const bool pulses = !others.pulsing || others.pulsing->contains(seen.offer.participant);
  const bool stands = is_named && pulses;
  if (stands) {
    seen.unnamed = 0;
  } else if (seen.unnamed == 0) {
    seen.unnamed = now;
  }
  seen.is_over = is_newer(newest_.at(seen.offer.participant), seen.offer.card.incarnation) ||
                 (!stands && now - seen.unnamed >= kUnnamed);
}

const Offer* Offers::speaker() const {
  const Offerer* const current = speaker_.current();
  return current == nullptr ? nullptr : &seen_.at(current->key).offer;
}

// One host has the source open once: who offers it beside its like for long is another machine.
void Offers::find_shared_name(shm::Nanoseconds now) {
  shared_name_.clear();
  std::map<std::string_view, Incarnation> first;
  for (const auto& [key, seen] : seen_) {
    const OfferCard& card = seen.offer.card;
    if (seen.is_over || now - seen.since < kNoEarlierLife) continue;
    const auto [one, is_new] = first.emplace(card.host, card.incarnation);
    if (!is_new && one->second != card.incarnation) shared_name_ = card.host;
  }
}

}  // namespace arbiter::link
