#include "link/core/cards.hpp"

#include "link/core/card_bytes.hpp"
#include "shm/limits.hpp"
#include "shm/utf8.hpp"

namespace arbiter::link {
namespace {

constexpr std::uint32_t kOfferMagic = 0x4f425241;   // "ARBO"
constexpr std::uint32_t kTokenMagic = 0x54425241;   // "ARBT"
constexpr std::uint32_t kDemandMagic = 0x44425241;  // "ARBD"

}  // namespace

ByteString write_offer_card(const OfferCard& card) {
  CardWriter writer(kOfferMagic, card.incarnation);
  writer.text(card.host);
  writer.text(card.source);
  writer.number(card.type_revision);
  if (card.type_revision != 0) {
    writer.number(card.type.size);
    writer.number(card.type.alignment);
    writer.text(card.type.type_name());
  }
  return writer.take();
}

ByteString write_token_message(const TokenMessage& message) {
  CardWriter writer(kTokenMagic, message.importer);
  writer.number(message.number);
  return writer.take();
}

ByteString write_demand_card(const DemandCard& card) {
  CardWriter writer(kDemandMagic, card.importer);
  writer.number(static_cast<std::uint8_t>(card.demand));
  return writer.take();
}

std::optional<OfferCard> read_offer_card(Bytes bytes) {
  CardReader reader(bytes, kOfferMagic);
  OfferCard card;
  card.incarnation = reader.number<std::uint64_t>();
  card.host = reader.text(shm::kMaxHostName);
  card.source = reader.text(shm::kMaxNameLength);
  card.type_revision = reader.number<std::uint32_t>();
  if (card.type_revision != 0) {
    card.type.size = reader.number<std::uint64_t>();
    card.type.alignment = reader.number<std::uint64_t>();
    const std::string name = reader.text(shm::kMaxTypeName);
    if (name.find('\0') != std::string::npos) return std::nullopt;
    card.type.set_name(name);
    if (shm::fault_of(card.type)) return std::nullopt;
  }
  if (!reader.is_good() || card.incarnation == 0 || !shm::is_host_name(card.host) ||
      !shm::is_port_name(card.source)) {
    return std::nullopt;
  }
  return card;
}

std::optional<TokenMessage> read_token_message(Bytes bytes) {
  CardReader reader(bytes, kTokenMagic);
  TokenMessage message;
  message.importer = reader.number<std::uint64_t>();
  message.number = reader.number<std::uint64_t>();
  if (!reader.is_good() || message.importer == 0 || message.number == 0) return std::nullopt;
  return message;
}

std::optional<DemandCard> read_demand_card(Bytes bytes) {
  CardReader reader(bytes, kDemandMagic);
  DemandCard card;
  card.importer = reader.number<std::uint64_t>();
  const auto demand = reader.number<std::uint8_t>();
  card.demand = static_cast<Demand>(demand);
  if (!reader.is_good() || card.importer == 0 || demand < 1 || card.demand > Demand::kHeaders) {
    return std::nullopt;
  }
  return card;
}

}  // namespace arbiter::link
