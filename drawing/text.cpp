#include "drawing/text.hpp"

#include <algorithm>
#include <vector>

#include "shm/utf8.hpp"

namespace arbiter::drawing {
namespace {

constexpr std::string_view kEllipsis = "…";
constexpr std::string_view kNextLine = "\n    ";
constexpr std::size_t kIndent = 4;

// Where each character begins, and the end. A byte that is no UTF-8 is a character.
std::vector<std::size_t> beginnings(std::string_view text) {
  std::vector<std::size_t> result{0};
  while (result.back() < text.size()) {
    const std::size_t length = shm::decode_utf8(text.substr(result.back())).length;
    result.push_back(result.back() + std::max<std::size_t>(1, length));
  }
  return result;
}

std::size_t next_operator(std::string_view formula, std::size_t from) {
  return std::min(formula.find(" ∧ ", from), formula.find(" ∨ ", from));
}

}  // namespace

std::string shortened(std::string_view text, std::size_t characters) {
  const auto at = beginnings(text);
  if (at.size() <= characters + 1) return std::string(text);
  const std::size_t front = (characters - 1) / 2, back = characters - 1 - front;
  return std::string(text.substr(0, at[front]))
      .append(kEllipsis)
      .append(text.substr(at[at.size() - 1 - back]));
}

std::string in_lines(std::string_view formula, std::size_t width, std::size_t max_lines) {
  std::string result;
  std::size_t column = 0, lines = 1;
  for (std::size_t begin = 0; begin < formula.size();) {
    const std::size_t end = std::min(next_operator(formula, begin + 1), formula.size());
    const std::string part = shortened(formula.substr(begin, end - begin), width);
    const std::size_t length = beginnings(part).size() - 1;
    if (column > 0 && column + length > width) {
      if (lines++ == max_lines) return result.append(" ").append(kEllipsis);
      result += kNextLine;
      column = kIndent;
    }
    result += part;
    column += length;
    begin = end;
  }
  return result;
}

}  // namespace arbiter::drawing
