// How MCAP writes numbers, strings and maps: little-endian, each length in front.
#pragma once

#include <concepts>
#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>

#include "recording/mcap.hpp"

namespace arbiter::recording {

template <std::unsigned_integral Number>
void append(std::string& out, Number number) {
  char bytes[sizeof number];
  for (std::size_t i = 0; i < sizeof number; ++i) bytes[i] = static_cast<char>(number >> (8 * i));
  out.append(bytes, sizeof bytes);
}

// Throw McapError where the content is longer than its length can say.
void append_string(std::string& out, std::string_view text);
void append_map(std::string& out, const McapMap& map);

// What is wrong with the bytes that are read; where, their reader knows.
struct Damage {
  std::string what;
};

// Takes one thing after the other from bytes that anybody may have written. Throws Damage where it
// would have to read behind them.
class ByteReader {
 public:
  explicit ByteReader(std::string_view bytes) noexcept : bytes_(bytes) {}

  template <std::unsigned_integral Number>
  Number number() {
    const std::string_view from = bytes(sizeof(Number));
    Number result = 0;
    for (std::size_t i = sizeof result; i-- > 0;) {
      result = static_cast<Number>(result << (sizeof result > 1 ? 8 : 0)) |
               static_cast<Number>(static_cast<unsigned char>(from[i]));
    }
    return result;
  }
  std::string_view bytes(std::uint64_t count);
  // With its length, 32 bits, in front.
  std::string_view string() { return bytes(number<std::uint32_t>()); }
  McapMap map();

  [[nodiscard]] std::size_t left() const noexcept { return bytes_.size(); }

 private:
  std::string_view bytes_;
};

}  // namespace arbiter::recording
