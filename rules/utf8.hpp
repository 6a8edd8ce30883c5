// As much of UTF-8, and of what counts as a blank, as reading a model takes.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>

namespace arbiter::rules {

struct Utf8Character {
  std::uint32_t code = 0;
  std::size_t length = 0;  // in bytes; 0 where they are not UTF-8
};

// The first character of `bytes`, in its shortest form and no surrogate, as the standard asks.
Utf8Character decode_utf8(std::string_view bytes);

std::string encode_utf8(std::uint32_t code);

// What XML counts as white space.
constexpr bool is_blank(char byte) {
  return byte == ' ' || byte == '\t' || byte == '\n' || byte == '\r';
}

constexpr bool is_control(std::uint32_t code) {
  return code < 0x20 || (code >= 0x7f && code < 0xa0);
}

// Characters that look like a blank, or like nothing, in an editor: in a name they would mislead.
constexpr bool is_invisible(std::uint32_t code) {
  return code == 0xa0 || code == 0x1680 || (code >= 0x2000 && code <= 0x200f) ||
         (code >= 0x2028 && code <= 0x202f) || (code >= 0x205f && code <= 0x2064) ||
         code == 0x3000 || code == 0xfeff;
}

}  // namespace arbiter::rules
