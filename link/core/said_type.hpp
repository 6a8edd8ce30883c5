// A source's type as those who read its card know it.
//
// Thread safety: none of its own.
#pragma once

#include <utility>

#include "link/core/cards.hpp"
#include "shm/type_info.hpp"

namespace arbiter::link {

// Has the type said by `say(card)`, with a revision of its own, if it is not the card's. The card
// becomes what was said: where say() throws, it stays, and the next call tries again. True: it is
// another type than before.
template <class Say>
bool say_type(OfferCard& card, const shm::TypeInfo& type, const Say& say) {
  if (card.type == type && card.type.size == type.size) return false;
  OfferCard next = card;
  ++next.type_revision;
  next.type = type;
  say(std::as_const(next));
  card = std::move(next);
  return true;
}

}  // namespace arbiter::link
