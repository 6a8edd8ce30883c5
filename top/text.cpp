#include "top/text.hpp"

#include <wchar.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <cstdio>

#include "shm/utf8.hpp"

namespace arbiter::top {
namespace {

// As the terminal's locale has it; 0 or less: nothing that could be shown by itself.
int width_of(std::uint32_t code) {
  if (shm::is_control(code) || (code != ' ' && shm::is_invisible(code))) return 0;
  return code < 0x80 ? 1 : ::wcwidth(static_cast<wchar_t>(code));
}

std::string escaped(std::string_view bytes) {
  std::string text;
  for (const char byte : bytes) {
    char escape[8];
    std::snprintf(escape, sizeof escape, "\\x%02x", static_cast<unsigned char>(byte));
    text += escape;
  }
  return text;
}

std::string with_unit(double value, int digits, const char* unit) {
  char text[64];
  std::snprintf(text, sizeof text, "%.*f%s", digits, value, unit);
  return text;
}

}  // namespace

std::string safe(std::string_view text, Charset charset) {
  std::string result;
  while (!text.empty()) {
    const shm::Utf8Character next = shm::decode_utf8(text);
    const std::size_t length = std::max<std::size_t>(next.length, 1);
    const bool is_shown = next.length != 0 && width_of(next.code) > 0 &&
                          (charset == Charset::kUtf8 || next.code < 0x80);
    result += is_shown ? std::string(text.substr(0, length)) : escaped(text.substr(0, length));
    text.remove_prefix(length);
  }
  return result;
}

std::size_t columns_of(std::string_view text) {
  std::size_t columns = 0;
  while (!text.empty()) {
    const shm::Utf8Character next = shm::decode_utf8(text);
    columns += static_cast<std::size_t>(std::max(width_of(next.code), 0));
    text.remove_prefix(std::max<std::size_t>(next.length, 1));
  }
  return columns;
}

std::string fit(std::string_view text, std::size_t columns, Align align, Charset charset) {
  std::string result = safe(text, charset);
  std::size_t width = columns_of(result);
  if (width > columns) {
    std::string_view rest = result;
    std::string cut;
    width = 0;
    while (columns != 0) {
      const shm::Utf8Character next = shm::decode_utf8(rest);
      const auto wide = static_cast<std::size_t>(std::max(width_of(next.code), 0));
      if (width + wide + 1 > columns) break;
      cut += rest.substr(0, next.length);
      width += wide;
      rest.remove_prefix(next.length);
    }
    if (columns != 0) {
      cut += charset == Charset::kUtf8 ? "…" : "~";
      ++width;
    }
    result = std::move(cut);
  }
  const std::string padding(columns - width, ' ');
  return align == Align::kLeft ? result + padding : padding + result;
}

std::string span(shm::Nanoseconds time) {
  const double seconds = static_cast<double>(std::max<shm::Nanoseconds>(time, 0)) / 1e9;
  if (seconds < 0.9995) return with_unit(seconds * 1e3, 0, " ms");
  if (seconds < 99.95) return with_unit(seconds, 1, " s");
  if (seconds < 999.5) return with_unit(seconds, 0, " s");
  if (seconds < 59'970) return with_unit(seconds / 60, 0, " min");
  if (seconds < 359'640) return with_unit(seconds / 3600, 0, " h");
  return with_unit(std::min(seconds / 86'400, 9999.0), 0, " d");
}

std::string short_span(shm::Nanoseconds time) {
  const auto value = static_cast<double>(std::max<shm::Nanoseconds>(time, 0));
  if (value < 999.5) return with_unit(value, 0, " ns");
  if (value < 9'950) return with_unit(value / 1e3, 1, " us");
  if (value < 999'500) return with_unit(value / 1e3, 0, " us");
  if (value < 9.95e6) return with_unit(value / 1e6, 1, " ms");
  return span(time);
}

std::string rate(double per_second) {
  if (per_second <= 0) return "0";
  if (per_second < 0.05) return "<0.1";
  if (per_second < 99.95) return with_unit(per_second, 1, "");
  if (per_second < 9'999.5) return with_unit(per_second, 0, "");
  if (per_second < 999'500) return with_unit(per_second / 1e3, 0, "k");
  return with_unit(std::min(per_second / 1e6, 9999.0), 0, "M");
}

std::string bar(double part, std::size_t columns, Charset charset) {
  static constexpr std::array<const char*, 8> kEighths = {"", "▏", "▎", "▍", "▌", "▋", "▊", "▉"};
  const auto steps = static_cast<double>(charset == Charset::kUtf8 ? columns * 8 : columns);
  const auto filled = static_cast<std::size_t>(std::ceil(std::clamp(part, 0.0, 1.0) * steps));
  std::string result;
  if (charset == Charset::kAscii) {
    return std::string(filled, '#') + std::string(columns - filled, ' ');
  }
  for (std::size_t i = 0; i < filled / 8; ++i) result += "█";
  result += kEighths[filled % 8];
  return result + std::string(columns - (filled + 7) / 8, ' ');
}

}  // namespace arbiter::top
