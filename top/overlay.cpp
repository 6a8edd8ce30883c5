#include "top/overlay.hpp"

#include <algorithm>
#include <string_view>

#include "shm/utf8.hpp"

namespace arbiter::top {
namespace {

// Bytes of the first so many columns; at least one character.
std::size_t bytes_of(std::string_view text, std::size_t columns) {
  std::size_t bytes = 0;
  std::size_t used = 0;
  while (bytes < text.size()) {
    const std::size_t length =
        std::max<std::size_t>(shm::decode_utf8(text.substr(bytes)).length, 1);
    used += columns_of(text.substr(bytes, length));
    if (bytes != 0 && used > columns) break;
    bytes += length;
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
  const std::string whole = safe(line, charset);
  auto [begin, indent] = indent_of(whole, columns);
  std::string_view rest = whole;
  std::string margin;  // before the rest
  std::vector<std::string> result;
  for (std::size_t end = 0; (end = bytes_of(rest, columns - margin.size())) < rest.size();) {
    const std::size_t blank = rest.rfind(' ', end);
    const bool has_words = blank != std::string_view::npos && blank > begin;
    if (has_words) end = blank;
    result.push_back(margin + std::string(rest.substr(0, end)));
    rest.remove_prefix(has_words ? end + 1 : end);
    margin.assign(indent, ' ');
    begin = 0;
    if (columns <= indent + 1) break;
  }
  margin += rest;
  result.push_back(fit(margin, std::min(columns_of(margin), columns), Align::kLeft, charset));
  return result;
}

void Overlay::scroll(std::ptrdiff_t by) {
  const auto to = static_cast<std::ptrdiff_t>(offset_) + by;
  offset_ = static_cast<std::size_t>(
      std::clamp<std::ptrdiff_t>(to, 0, static_cast<std::ptrdiff_t>(most_)));
}

// Anew only where the screen is another: an answer may be long, and is drawn ten times a second.
void Overlay::break_lines(std::size_t width, Charset charset) {
  const std::pair wanted(width, charset);
  if (broken_for_ == wanted) return;
  broken_for_ = wanted;
  parts_.clear();
  for (const std::string& each : lines_) {
    for (std::string& part : broken(each, width, charset)) parts_.push_back(std::move(part));
  }
}

std::vector<Line> Overlay::draw(std::size_t width, std::size_t height, Charset charset) {
  break_lines(width, charset);
  const std::vector<std::string>& all = parts_;
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
