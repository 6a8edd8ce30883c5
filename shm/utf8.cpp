#include "shm/utf8.hpp"

#include <algorithm>

#include "shm/limits.hpp"

namespace arbiter::shm {

Utf8Character decode_utf8(std::string_view bytes) {
  if (bytes.empty()) return {};
  const auto byte = [&](std::size_t i) {
    return std::uint32_t{static_cast<unsigned char>(bytes[i])};
  };
  const std::uint32_t first = byte(0);
  if (first < 0x80) return {first, 1};

  std::size_t length = 0;
  std::uint32_t smallest = 0;  // that needs this many bytes
  std::uint32_t code = 0;
  if (first >> 5 == 0b110) {
    length = 2, smallest = 0x80, code = first & 0x1f;
  } else if (first >> 4 == 0b1110) {
    length = 3, smallest = 0x800, code = first & 0x0f;
  } else if (first >> 3 == 0b11110) {
    length = 4, smallest = 0x10000, code = first & 0x07;
  }
  if (length == 0 || bytes.size() < length) return {};
  for (std::size_t i = 1; i < length; ++i) {
    if (byte(i) >> 6 != 0b10) return {};
    code = code << 6 | (byte(i) & 0x3f);
  }
  if (code < smallest || code > 0x10ffff || (code >= 0xd800 && code <= 0xdfff)) return {};
  return {code, length};
}

std::string encode_utf8(std::uint32_t code) {
  const auto tail = [&](int shift) { return static_cast<char>(0x80 | (code >> shift & 0x3f)); };
  if (code < 0x80) return {static_cast<char>(code)};
  if (code < 0x800) return {static_cast<char>(0xc0 | code >> 6), tail(0)};
  if (code < 0x10000) return {static_cast<char>(0xe0 | code >> 12), tail(6), tail(0)};
  return {static_cast<char>(0xf0 | code >> 18), tail(12), tail(6), tail(0)};
}

std::string_view beginning_of(std::string_view text, std::size_t most) noexcept {
  if (text.size() <= most) return text;
  while (most > 0 && (static_cast<unsigned char>(text[most]) & 0xc0) == 0x80) --most;
  return text.substr(0, most);
}

std::optional<NameFault> find_fault_in_name(std::string_view name) {
  for (std::size_t i = 0; i < name.size();) {
    const Utf8Character character = decode_utf8(name.substr(i));
    if (is_blank(name[i])) return NameFault{"white space", i};
    if (name[i] == '"') return NameFault{"a double quote", i};
    if (character.length == 0) return NameFault{"a byte that is not UTF-8", i};
    if (is_control(character.code) || is_invisible(character.code)) {
      return NameFault{"an invisible character", i};
    }
    i += character.length;
  }
  return {};
}

bool is_port_name(std::string_view name) {
  return name.size() <= kMaxNameLength && name.starts_with('/') && !find_fault_in_name(name);
}

bool is_host_name(std::string_view name) noexcept {
  const auto is_fine = [](char c) {
    return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '.' ||
           c == '-' || c == '_';
  };
  return !name.empty() && name.size() <= kMaxHostName &&
         std::all_of(name.begin(), name.end(), is_fine);
}

std::string printable(std::string_view text, std::string_view kept) {
  static constexpr char kDigits[] = "0123456789abcdef";
  std::string result;
  while (!text.empty()) {
    const Utf8Character character = decode_utf8(text);
    const std::string_view bytes = text.substr(0, character.length == 0 ? 1 : character.length);
    const bool misleads = is_control(character.code) || is_invisible(character.code);
    const bool stays = character.length != 0 && (!misleads || kept.find(text.front()) != kept.npos);
    if (stays) {
      result += bytes;
    } else if (text.front() == '\n') {
      result += "\\n";
    } else {
      for (const char byte : bytes) {
        result += "\\x";
        result += kDigits[byte >> 4 & 15];
        result += kDigits[byte & 15];
      }
    }
    text.remove_prefix(bytes.size());
  }
  return result;
}

}  // namespace arbiter::shm
