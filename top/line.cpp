#include "top/line.hpp"

#include <algorithm>
#include <numeric>

namespace arbiter::top {
namespace {

constexpr std::size_t kLeastFlexible = 10;

std::size_t natural_width(const Table& table, std::size_t column, Charset charset) {
  std::size_t width = columns_of(table.columns[column].title) + 1;  // and a mark
  for (const Row& row : table.rows) {
    width = std::max(width, columns_of(safe(row.cells[column].text, charset)));
  }
  return width;
}

// Gives each of them at most what it wants; those that want less than a fair share leave the rest
// to the others.
void share_out(std::vector<std::size_t>& widths, std::vector<std::size_t> flexible,
               std::size_t& room) {
  std::sort(flexible.begin(), flexible.end(),
            [&](std::size_t a, std::size_t b) { return widths[a] < widths[b]; });
  std::size_t left = flexible.size();
  for (const std::size_t column : flexible) {
    widths[column] = std::min(widths[column], room / left--);
    room -= widths[column];
  }
}

}  // namespace

std::string Line::text() const {
  std::string result;
  for (const Span& span : spans) result += span.text;
  result.erase(result.find_last_not_of(' ') + 1);
  return result;
}

Line line_of(std::string_view text, std::size_t columns, Style style, Charset charset) {
  return {{{fit(text, columns, Align::kLeft, charset), style}}};
}

void Table::sort(std::size_t column, bool descending) {
  const bool is_number = columns[column].is_number;
  const auto before = [&](const Row& a, const Row& b) {
    const Cell& one = a.cells[column];
    const Cell& other = b.cells[column];
    return is_number ? one.order < other.order : one.text < other.text;
  };
  std::stable_sort(rows.begin(), rows.end(), [&](const Row& a, const Row& b) {
    return descending ? before(b, a) : before(a, b);
  });
}

std::vector<std::size_t> Table::widths(std::size_t room, Charset charset) const {
  std::vector<bool> is_shown(columns.size(), true);
  const auto least = [&] {  // each but the first begins with a blank
    std::size_t sum = 0;
    for (std::size_t i = 0; i < columns.size(); ++i) {
      if (is_shown[i]) sum += 1 + (columns[i].width != 0 ? columns[i].width : kLeastFlexible);
    }
    return sum - 1;
  };
  while (least() > room) {
    std::size_t worst = 0;
    for (std::size_t i = 0; i < columns.size(); ++i) {
      if (is_shown[i] && (!is_shown[worst] || columns[i].rank >= columns[worst].rank)) worst = i;
    }
    if (columns[worst].rank == 0) break;
    is_shown[worst] = false;
  }
  std::vector<std::size_t> widths(columns.size(), 0);
  std::vector<std::size_t> first;  // of rank 0
  std::vector<std::size_t> others;
  std::size_t fixed = 0;
  for (std::size_t i = 0; i < columns.size(); ++i) {
    if (!is_shown[i]) continue;
    widths[i] = columns[i].width;
    fixed += 1 + widths[i];
    if (widths[i] != 0) continue;
    widths[i] = natural_width(*this, i, charset);
    (columns[i].rank == 0 ? first : others).push_back(i);
  }
  const std::size_t left = room + 1 > fixed ? room + 1 - fixed : 0;
  const std::size_t kept = std::min(left, others.size() * kLeastFlexible);
  std::size_t of_first = left - kept;
  share_out(widths, first, of_first);
  std::size_t of_others = of_first + kept;
  share_out(widths, others, of_others);
  return widths;
}

Line Table::line(const Row& row, const std::vector<std::size_t>& widths, bool is_selected,
                 Charset charset) const {
  Line line;
  line.is_selected = is_selected;
  for (std::size_t i = 0; i < columns.size(); ++i) {
    if (widths[i] == 0) continue;
    if (!line.spans.empty()) line.spans.push_back({" ", Style::kPlain});
    line.spans.push_back(
        {fit(row.cells[i].text, widths[i], columns[i].align, charset), row.cells[i].style});
  }
  return line;
}

Line Table::header(const std::vector<std::size_t>& widths, std::size_t sorted, bool descending,
                   Charset charset) const {
  Row titles;
  for (std::size_t i = 0; i < columns.size(); ++i) {
    const bool is_utf8 = charset == Charset::kUtf8;
    const std::string mark = i != sorted  ? ""
                             : descending ? (is_utf8 ? "▾" : "v")
                                          : (is_utf8 ? "▴" : "^");
    titles.cells.push_back({columns[i].title + mark, Style::kHeader});
  }
  Line line = this->line(titles, widths, false, charset);
  for (Span& span : line.spans) span.style = Style::kHeader;
  return line;
}

}  // namespace arbiter::top
