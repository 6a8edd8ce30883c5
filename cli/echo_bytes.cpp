// Bytes of samples, for people to read.
#include <algorithm>

#include "cli/echo.hpp"

namespace arbiter::cli {
namespace {

constexpr std::size_t kBytesOfALine = 16;
constexpr char kHex[] = "0123456789abcdef";

}  // namespace

std::string hex_of(const Bytes& bytes, std::size_t most) {
  std::string text;
  for (std::size_t i = 0; i < bytes.size() && i < most; ++i) {
    const auto value = std::to_integer<unsigned>(bytes[i]);
    if (i != 0) text += ' ';
    text += kHex[value >> 4];
    text += kHex[value & 15];
  }
  return text;
}

std::string preview(const Bytes& bytes) {
  const std::string text = hex_of(bytes, kBytesOfALine);
  return bytes.size() > kBytesOfALine ? text + " …" : text;
}

std::string hex_dump(const Bytes& bytes) {
  std::string text;
  for (std::size_t at = 0; at < bytes.size(); at += kBytesOfALine) {
    std::string offset(8, '0');
    for (std::size_t digit = 0; digit < offset.size(); ++digit) {
      offset[offset.size() - 1 - digit] = kHex[at >> (4 * digit) & 15];
    }
    const std::size_t count = std::min(kBytesOfALine, bytes.size() - at);
    text += "    " + offset + "  " + hex_of({bytes.data() + at, count}, count) + '\n';
  }
  return text;
}

}  // namespace arbiter::cli
