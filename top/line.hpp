// A line of the screen, as text with meanings; and tables of them.
#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include "top/names.hpp"
#include "top/text.hpp"

namespace arbiter::top {

// What a text means. The screen says it in colour where it can; no meaning depends on that.
enum class Style {
  kPlain,
  kTitle,
  kHeader,
  kDim,
  kWinner,
  kIdle,
  kWarning,
  kBar,
};

struct Span {
  std::string text;  // safe
  Style style = Style::kPlain;
};
struct Line {
  std::vector<Span> spans;
  bool is_selected = false;

  [[nodiscard]] std::string text() const;
};
// One span, cut to that many columns.
[[nodiscard]] Line line_of(std::string_view text, std::size_t columns, Style style,
                           Charset charset);

// A name of a port within a text: where room is short, names are cut and the other words stay.
struct NamePlace {
  std::size_t begin = 0;
  std::size_t length = 0;
};
struct Cell {
  std::string text;
  Style style = Style::kPlain;
  double order = 0;  // what a column of numbers is sorted by
  std::vector<NamePlace> names{};
};
struct Row {
  std::string name;  // by which it is found again in the next picture
  std::vector<Cell> cells;
  bool is_marked = false;
};
struct Column {
  std::string title;
  std::size_t width = 0;  // 0: as wide as its texts, and narrower where room is short
  Align align = Align::kLeft;
  int rank = 0;  // where room is short, those of the highest rank go first; 0 stays
  bool is_number = false;
  // Of one as wide as its texts: before it gets less than this, columns of a rank go.
  std::size_t least = 10;
  // And it is as wide as this even if its texts are not, so that columns do not come and go with
  // what happens to stand in it.
  std::size_t wanted = 0;
};
struct Table {
  std::vector<Column> columns;
  std::vector<Row> rows;

  // Keeps the order of equals.
  void sort(std::size_t column, bool descending);
  // 0 for a column that is left out. `room`: columns of the terminal.
  [[nodiscard]] std::vector<std::size_t> widths(std::size_t room, Charset charset) const;
  // `names`: cuts names; null: they are cut at the end, like other texts.
  [[nodiscard]] Line line(const Row& row, const std::vector<std::size_t>& widths, bool is_selected,
                          Charset charset, ShortNames* names = nullptr) const;
  // `sorted`: which column has a mark.
  [[nodiscard]] Line header(const std::vector<std::size_t>& widths, std::size_t sorted,
                            bool descending, Charset charset) const;
};

}  // namespace arbiter::top
