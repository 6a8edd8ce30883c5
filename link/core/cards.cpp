#include "link/core/cards.hpp"

#include <algorithm>
#include <cstring>
#include <string_view>

#include "link/core/little_endian.hpp"
#include "shm/limits.hpp"
#include "shm/utf8.hpp"

namespace arbiter::link {
namespace {

constexpr std::uint32_t kOfferMagic = 0x4f425241;  // "ARBO"
constexpr std::uint32_t kTokenMagic = 0x54425241;  // "ARBT"
constexpr std::uint8_t kCardVersion = 1;

class CardWriter {
 public:
  CardWriter(std::uint32_t magic, Incarnation incarnation) {
    number(magic);
    number(kCardVersion);
    number(incarnation);
  }
  template <class Number>
  void number(Number value) {
    const std::size_t at = bytes_.size();
    bytes_.resize(at + sizeof value);
    put(bytes_.data() + at, value);
  }
  void text(std::string_view text) {
    number(static_cast<std::uint16_t>(text.size()));
    for (const char each : text) bytes_.push_back(static_cast<std::byte>(each));
  }
  ByteString take() { return std::move(bytes_); }

 private:
  ByteString bytes_;
};

// Once something is missing, all that follows is 0 or empty.
class CardReader {
 public:
  CardReader(Bytes bytes, std::uint32_t magic) : bytes_(bytes) {
    is_good_ = number<std::uint32_t>() == magic && number<std::uint8_t>() == kCardVersion;
  }
  template <class Number>
  Number number() {
    const std::byte* const from = take(sizeof(Number));
    return from == nullptr ? Number{} : get<Number>(from);
  }
  std::string text(std::size_t most) {
    const std::size_t length = number<std::uint16_t>();
    if (length > most) is_good_ = false;
    const std::byte* const from = take(length);
    if (from == nullptr) return {};
    return {reinterpret_cast<const char*>(from), length};
  }
  [[nodiscard]] bool is_good() const { return is_good_; }

 private:
  const std::byte* take(std::size_t count) {
    if (!is_good_ || bytes_.size() - at_ < count) {
      is_good_ = false;
      return nullptr;
    }
    const std::byte* const from = bytes_.data() + at_;
    at_ += count;
    return from;
  }

  Bytes bytes_;
  std::size_t at_ = 0;
  bool is_good_ = true;
};

bool is_port_name(const std::string& name) {
  return name.size() > 1 && name.front() == '/' && !shm::find_fault_in_name(name);
}

}  // namespace

bool is_host_name(const std::string& name) noexcept {
  const auto is_fine = [](char c) {
    return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '.' ||
           c == '-' || c == '_';
  };
  return !name.empty() && name.size() <= kMaxHostName &&
         std::all_of(name.begin(), name.end(), is_fine);
}

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

std::optional<OfferCard> read_offer_card(Bytes bytes) {
  CardReader reader(bytes, kOfferMagic);
  OfferCard card;
  card.incarnation = reader.number<std::uint64_t>();
  card.host = reader.text(kMaxHostName);
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
  if (!reader.is_good() || card.incarnation == 0 || !is_host_name(card.host) ||
      !is_port_name(card.source)) {
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

}  // namespace arbiter::link
