// What a link says of its host to all others: who it is, what model is in force there, which ports
// components have open.
//
// A card is sent whole, and again when something has changed. It comes from strangers: what is read
// is bounded, and its names are those that hosts, models and ports may have.
//
//   "ARBH", version 1, incarnation of the link (8); texts: host, instance, version; 1 byte: bit 0,
//   there is a daemon; generation of the model (8), its digest (8); a text: its name; imports (4);
//   then twice, for input ports and output ports: how many there are (4), how many follow (4),
//   their names in byte order, each once
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "link/core/cards.hpp"

namespace arbiter::link {

// Of ports in one card, of each kind; and bytes of a card.
inline constexpr std::size_t kMaxPortsOfCard = 4096;
inline constexpr std::size_t kMaxCardBytes = std::size_t{256} << 10;
inline constexpr std::size_t kMaxVersionName = 64;
inline constexpr std::size_t kMaxModelName = 255;

struct HostCard {
  Incarnation incarnation = 0;  // of the link: another after each start
  std::string host;
  std::string instance;
  std::string version;
  bool has_daemon = false;
  std::uint64_t generation = 0;  // 0: no model is in force
  std::uint64_t digest = 0;      // of the model's texts; 0: not known
  std::string model;             // its name; empty: it has none
  std::uint32_t imports = 0;
  // How many there are, and their names: all, unless the card would be too large.
  std::uint32_t input_count = 0;
  std::uint32_t output_count = 0;
  std::vector<std::string> inputs;
  std::vector<std::string> outputs;

  [[nodiscard]] bool names_all() const {
    return inputs.size() == input_count && outputs.size() == output_count;
  }
  friend bool operator==(const HostCard&, const HostCard&) = default;
};

// Names that find no place are left out.
[[nodiscard]] ByteString write_host_card(const HostCard& card);
// Nothing: it is none, or not a proper one.
[[nodiscard]] std::optional<HostCard> read_host_card(Bytes bytes);
// Whether it is a card as another version of this program writes it.
[[nodiscard]] bool is_of_other_version(Bytes bytes);

// A number for texts that differs where they differ: to compare models, not to trust them.
class Digest {
 public:
  // Texts one by one: "a", "b" is another model than "ab".
  void add(std::string_view text) noexcept;
  // Never 0.
  [[nodiscard]] std::uint64_t value() const noexcept { return value_ == 0 ? 1 : value_; }

 private:
  void add_byte(unsigned char byte) noexcept;

  std::uint64_t value_ = 0xcbf29ce484222325;
};
// 16 hexadecimal digits.
[[nodiscard]] std::string hexadecimal(std::uint64_t value);

}  // namespace arbiter::link
