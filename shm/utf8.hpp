// As much of UTF-8 as it takes to read a model, to judge a name, and to write what others have said
// so that a terminal, a log or a line-based tool cannot be misled by it.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

namespace arbiter::shm {

struct Utf8Character {
  std::uint32_t code = 0;
  std::size_t length = 0;  // in bytes; 0 where they are not UTF-8
};

// The first character of `bytes`, in its shortest form and no surrogate, as the standard asks.
Utf8Character decode_utf8(std::string_view bytes);

std::string encode_utf8(std::uint32_t code);

// As much of `text` as fits into so many bytes without cutting a character in two.
std::string_view beginning_of(std::string_view text, std::size_t most) noexcept;

// What XML counts as white space.
constexpr bool is_blank(char byte) {
  return byte == ' ' || byte == '\t' || byte == '\n' || byte == '\r';
}

constexpr bool is_control(std::uint32_t code) {
  return code < 0x20 || (code >= 0x7f && code < 0xa0);
}

// Characters that look like a blank or like nothing in an editor, or that reorder what stands
// beside them: in a name they would mislead.
constexpr bool is_invisible(std::uint32_t code) {
  return code == 0xa0 || code == 0xad || code == 0x61c || code == 0x1680 ||
         (code >= 0x2000 && code <= 0x200f) || (code >= 0x2028 && code <= 0x202f) ||
         (code >= 0x205f && code <= 0x206f) || code == 0x3000 || code == 0xfeff ||
         (code >= 0xfff9 && code <= 0xfffb) || (code >= 0xe0000 && code <= 0xe007f);
}

// What a name must not have in it, and at which byte: white space, a double quote (which could not
// be written in a condition), an invisible or a control character, a byte that is not UTF-8.
struct NameFault {
  const char* what;
  std::size_t at;
};
std::optional<NameFault> find_fault_in_name(std::string_view name);

// Whether a port may be called so: at most kMaxNameLength bytes, the first '/', and no fault.
bool is_port_name(std::string_view name);

inline constexpr std::size_t kMaxHostName = 64;

// Whether a host may be called so: 1 to kMaxHostName letters, digits, `.`, `-` and `_`.
bool is_host_name(std::string_view name) noexcept;

// `text` with control and invisible characters, and bytes that are not UTF-8, written as escapes: a
// line end as \n, others as \xNN, byte by byte. Those in `kept`, which is ASCII, stay.
std::string printable(std::string_view text, std::string_view kept = {});

}  // namespace arbiter::shm
