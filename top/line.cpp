#include "top/line.hpp"

#include <algorithm>
#include <numeric>

namespace arbiter::top {
namespace {

// A name of fewer columns says nothing.
constexpr std::size_t kLeastName = 4;

std::size_t natural_width(const Table& table, std::size_t column, Charset charset) {
  std::size_t width = columns_of(table.columns[column].title) + 1;  // and a mark
  width = std::max(width, table.columns[column].wanted);
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

// First each gets its least, then the rest is shared out.
void give(std::vector<std::size_t>& widths, const std::vector<Column>& columns,
          const std::vector<std::size_t>& flexible, std::size_t& room) {
  std::vector<std::size_t> least(widths.size(), 0);
  std::size_t sum = 0;
  for (const std::size_t column : flexible) {
    least[column] = std::min(widths[column], columns[column].least);
    sum += least[column];
  }
  if (sum > room) {
    share_out(widths, flexible, room);
    return;
  }
  room -= sum;
  for (const std::size_t column : flexible) widths[column] -= least[column];
  share_out(widths, flexible, room);
  for (const std::size_t column : flexible) widths[column] += least[column];
}

// The cell's text with its names cut, so that it is no wider than that.
std::string with_short_names(const Cell& cell, std::size_t columns, Charset charset,
                             ShortNames& names) {
  std::vector<std::size_t> widths;
  std::vector<std::size_t> order;
  std::size_t others = columns_of(safe(cell.text, charset));
  if (others <= columns) return cell.text;
  for (const NamePlace& each : cell.names) {
    order.push_back(widths.size());
    widths.push_back(columns_of(safe(cell.text.substr(each.begin, each.length), charset)));
    others -= widths.back();
  }
  if (columns < others + kLeastName * widths.size()) return cell.text;
  std::size_t room = columns - others;
  share_out(widths, order, room);
  std::string result;
  std::size_t end = 0;
  for (std::size_t i = 0; i < cell.names.size(); ++i) {
    const NamePlace& each = cell.names[i];
    result += safe(cell.text.substr(end, each.begin - end), charset);
    result += names.cut(cell.text.substr(each.begin, each.length), widths[i]);
    end = each.begin + each.length;
  }
  return result + safe(cell.text.substr(end), charset);
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
  std::vector<std::size_t> widths(columns.size(), 0);
  for (std::size_t i = 0; i < columns.size(); ++i) {
    widths[i] = columns[i].width != 0 ? columns[i].width : natural_width(*this, i, charset);
  }
  const auto least = [&] {  // each but the first begins with a blank
    std::size_t sum = 0;
    for (std::size_t i = 0; i < columns.size(); ++i) {
      if (widths[i] == 0) continue;
      sum += 1 + (columns[i].width != 0 ? widths[i] : std::min(widths[i], columns[i].least));
    }
    return sum - 1;
  };
  while (least() > room) {
    std::size_t worst = 0;
    for (std::size_t i = 0; i < columns.size(); ++i) {
      if (widths[i] != 0 && columns[i].rank >= columns[worst].rank) worst = i;
    }
    if (columns[worst].rank == 0) break;
    widths[worst] = 0;
  }
  std::vector<std::size_t> first;  // of rank 0
  std::vector<std::size_t> others;
  std::size_t fixed = 0;
  std::size_t kept = 0;
  for (std::size_t i = 0; i < columns.size(); ++i) {
    if (widths[i] == 0) continue;
    fixed += 1 + columns[i].width;
    if (columns[i].width != 0) continue;
    (columns[i].rank == 0 ? first : others).push_back(i);
    if (columns[i].rank != 0) kept += std::min(widths[i], columns[i].least);
  }
  const std::size_t left = room + 1 > fixed ? room + 1 - fixed : 0;
  kept = std::min(left, kept);
  std::size_t of_first = left - kept;
  give(widths, columns, first, of_first);
  std::size_t of_others = of_first + kept;
  give(widths, columns, others, of_others);
  return widths;
}

Line Table::line(const Row& row, const std::vector<std::size_t>& widths, bool is_selected,
                 Charset charset, ShortNames* names) const {
  Line line;
  line.is_selected = is_selected;
  for (std::size_t i = 0; i < columns.size(); ++i) {
    if (widths[i] == 0) continue;
    if (!line.spans.empty()) line.spans.push_back({" ", Style::kPlain});
    const Cell& cell = row.cells[i];
    const std::string text = names == nullptr || cell.names.empty()
                                 ? cell.text
                                 : with_short_names(cell, widths[i], charset, *names);
    line.spans.push_back({fit(text, widths[i], columns[i].align, charset), cell.style});
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
