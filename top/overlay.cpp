#include "top/overlay.hpp"

#include <algorithm>

#include "shm/utf8.hpp"

namespace arbiter::top {
namespace {

// Bytes of the first so many columns; at least one character.
std::size_t bytes_of(std::string_view text, std::size_t columns) {
  std::size_t bytes = 0;
  while (bytes < text.size()) {
    const std::size_t next =
        bytes + std::max<std::size_t>(shm::decode_utf8(text.substr(bytes)).length, 1);
    if (bytes != 0 && columns_of(text.substr(0, next)) > columns) break;
    bytes = next;
  }
  return bytes;
}

struct Indent {
  std::size_t begin = 0;    // of the words that may be broken, in bytes
  std::size_t columns = 0;  // of what continues them
};
Indent indent_of(const std::string& line, std::size_t columns) {
  const std::size_t begin = std::min(line.find_first_not_of(' '), line.size());
  const std::size_t gap = line.find("  ", begin);
  const std::size_t meaning = gap == std::string::npos ? gap : line.find_first_not_of(' ', gap);
  if (meaning != std::string::npos) {
    const std::size_t place = columns_of(std::string_view(line).substr(0, meaning));
    if (place <= columns / 2) return {meaning, place};
  }
  return {begin, std::min(begin + 2, columns / 2)};
}

}  // namespace

std::vector<std::string> broken(const std::string& line, std::size_t columns, Charset charset) {
  std::string rest = safe(line, charset);
  auto [begin, indent] = indent_of(rest, columns);
  std::vector<std::string> result;
  while (columns_of(rest) > columns) {
    std::size_t end = bytes_of(rest, columns);
    const std::size_t blank = rest.rfind(' ', end);
    const bool has_words = blank != std::string::npos && blank > begin;
    if (has_words) end = blank;
    result.push_back(rest.substr(0, end));
    rest = std::string(indent, ' ') + rest.substr(has_words ? end + 1 : end);
    begin = indent;
    if (columns <= indent + 1) break;
  }
  result.push_back(fit(rest, std::min(columns_of(rest), columns), Align::kLeft, charset));
  return result;
}

void Overlay::scroll(std::ptrdiff_t by) {
  const auto to = static_cast<std::ptrdiff_t>(offset_) + by;
  offset_ = static_cast<std::size_t>(
      std::clamp<std::ptrdiff_t>(to, 0, static_cast<std::ptrdiff_t>(most_)));
}

std::vector<Line> Overlay::draw(std::size_t width, std::size_t height, Charset charset) {
  std::vector<std::string> all;
  for (const std::string& each : lines_) {
    for (std::string& part : broken(each, width, charset)) all.push_back(std::move(part));
  }
  page_ = std::max<std::size_t>(height, 2) - 1;
  most_ = all.size() > page_ ? all.size() - page_ : 0;
  offset_ = std::min(offset_, most_);
  std::string title = title_;
  if (most_ != 0) {
    title += "  (" + std::to_string(offset_ + 1) + "-" +
             std::to_string(std::min(offset_ + page_, all.size())) + " of " +
             std::to_string(all.size()) + ")";
  }
  std::vector<Line> result{line_of(title, width, Style::kHeader, charset)};
  for (std::size_t i = offset_; i < all.size() && result.size() < height; ++i) {
    result.push_back(line_of(all[i], width, Style::kPlain, charset));
  }
  return result;
}

}  // namespace arbiter::top
