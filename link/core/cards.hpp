// What a link says about a source that it offers, in the user data of a DDS writer, and about one
// that it wants, in those of a reader; and the message that carries a token.
//
// All of it comes from strangers: sizes are bounded, names must be those that ports, hosts and
// types may have, and anything else is refused.
//
//   offer   "ARBO", version 1 (1 byte), incarnation (8), two texts: the host's name, the source's
//           name; revision of the type (4); if that is not 0: size (8), alignment (8), and a text:
//           the type's name, empty if it is untyped
//   token   "ARBT", version 1, incarnation of the importer, number (8)
//   demand  "ARBD", version 1, incarnation of the importer, what it wants (1; demand.hpp)
//
// A text is its length (2 bytes) and its bytes. Numbers are little-endian. What follows the end is
// padding and is passed over.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>

#include <arbiter/bytes.hpp>

#include "link/core/card_bytes.hpp"
#include "link/core/demand.hpp"
#include "link/core/held_tokens.hpp"
#include "shm/type_info.hpp"

namespace arbiter::link {

// Of a writer: an output port that is open there.
struct OfferCard {
  // Of this offer. The port that is opened again is another one.
  Incarnation incarnation = 0;
  std::string host;
  std::string source;
  // 0: not known yet. Another one for each type that the source has had.
  std::uint32_t type_revision = 0;
  shm::TypeInfo type;
};

struct TokenMessage {
  Incarnation importer = 0;
  std::uint64_t number = 0;
};

// Of a reader: what its host wants of the source.
struct DemandCard {
  Incarnation importer = 0;
  Demand demand = Demand::kSamples;
};

[[nodiscard]] ByteString write_offer_card(const OfferCard& card);
[[nodiscard]] ByteString write_token_message(const TokenMessage& message);
[[nodiscard]] ByteString write_demand_card(const DemandCard& card);

// Nothing: it is none, or not a proper one.
[[nodiscard]] std::optional<OfferCard> read_offer_card(Bytes bytes);
[[nodiscard]] std::optional<TokenMessage> read_token_message(Bytes bytes);
[[nodiscard]] std::optional<DemandCard> read_demand_card(Bytes bytes);

}  // namespace arbiter::link
