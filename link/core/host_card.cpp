#include "link/core/host_card.hpp"

#include <algorithm>

#include "link/core/card_bytes.hpp"
#include "shm/limits.hpp"
#include "shm/utf8.hpp"

namespace arbiter::link {
namespace {

constexpr std::uint32_t kHostMagic = 0x48425241;  // "ARBH"
constexpr std::uint8_t kHasDaemon = 1;
// Of each of the two lists; what is left is for the rest.
constexpr std::size_t kMostPortBytes = (kMaxCardBytes - 1024) / 2;

// Strangers' words go to logs and terminals.
bool is_plain(const std::string& text) { return shm::printable(text) == text; }

bool is_instance_name(const std::string& name) {
  return !name.empty() && name.front() != '.' && shm::is_host_name(name);
}

// As many as there is room for.
void write_ports(CardWriter& writer, std::uint32_t count, const std::vector<std::string>& ports) {
  std::size_t fitting = 0;
  for (std::size_t bytes = 0; fitting < std::min(ports.size(), kMaxPortsOfCard); ++fitting) {
    bytes += 2 + ports[fitting].size();
    if (bytes > kMostPortBytes) break;
  }
  writer.number(count);
  writer.number(static_cast<std::uint32_t>(fitting));
  for (std::size_t i = 0; i < fitting; ++i) writer.text(ports[i]);
}

void read_ports(CardReader& reader, std::uint32_t& count, std::vector<std::string>& ports) {
  count = reader.number<std::uint32_t>();
  const auto following = reader.number<std::uint32_t>();
  reader.require(following <= kMaxPortsOfCard && following <= count);
  for (std::size_t i = 0, bytes = 0; i < following && reader.is_good(); ++i) {
    ports.push_back(reader.text(shm::kMaxNameLength));
    bytes += 2 + ports.back().size();
    reader.require(bytes <= kMostPortBytes);
    reader.require(shm::is_port_name(ports.back()) && (i == 0 || ports[i - 1] < ports[i]));
  }
}

}  // namespace

ByteString write_host_card(const HostCard& card) {
  CardWriter writer(kHostMagic, card.incarnation);
  writer.text(card.host);
  writer.text(card.instance);
  writer.text(std::string_view(card.version).substr(0, kMaxVersionName));
  writer.number(card.has_daemon ? kHasDaemon : std::uint8_t{0});
  writer.number(card.generation);
  writer.number(card.digest);
  writer.text(std::string_view(card.model).substr(0, kMaxModelName));
  writer.number(card.imports);
  write_ports(writer, card.input_count, card.inputs);
  write_ports(writer, card.output_count, card.outputs);
  return writer.take();
}

std::optional<HostCard> read_host_card(Bytes bytes) {
  if (bytes.size() > kMaxCardBytes) return std::nullopt;
  CardReader reader(bytes, kHostMagic);
  HostCard card;
  card.incarnation = reader.number<std::uint64_t>();
  card.host = reader.text(shm::kMaxHostName);
  card.instance = reader.text(shm::kMaxHostName);
  card.version = reader.text(kMaxVersionName);
  const auto flags = reader.number<std::uint8_t>();
  card.has_daemon = flags == kHasDaemon;
  card.generation = reader.number<std::uint64_t>();
  card.digest = reader.number<std::uint64_t>();
  card.model = reader.text(kMaxModelName);
  card.imports = reader.number<std::uint32_t>();
  reader.require(card.incarnation != 0 && flags <= kHasDaemon && shm::is_host_name(card.host) &&
                 is_instance_name(card.instance) && is_plain(card.version) && is_plain(card.model));
  read_ports(reader, card.input_count, card.inputs);
  read_ports(reader, card.output_count, card.outputs);
  if (!reader.is_good()) return std::nullopt;
  return card;
}

bool is_of_other_version(Bytes bytes) {
  return bytes.size() > sizeof kHostMagic && get<std::uint32_t>(bytes.data()) == kHostMagic &&
         get<std::uint8_t>(bytes.data() + sizeof kHostMagic) != kCardVersion;
}

// FNV-1a: https://datatracker.ietf.org/doc/html/draft-eastlake-fnv
void Digest::add_byte(unsigned char byte) noexcept {
  value_ ^= byte;
  value_ *= 0x100000001b3;
}

void Digest::add(std::string_view text) noexcept {
  for (std::uint64_t length = text.size(), i = 0; i < sizeof length; ++i) {
    add_byte(static_cast<unsigned char>(length >> (8 * i)));
  }
  for (const char c : text) add_byte(static_cast<unsigned char>(c));
}

std::string hexadecimal(std::uint64_t value) {
  constexpr std::string_view kDigits = "0123456789abcdef";
  std::string text(16, '0');
  for (auto digit = text.rbegin(); digit != text.rend(); ++digit, value >>= 4U) {
    *digit = kDigits[value & 15U];
  }
  return text;
}

}  // namespace arbiter::link
