// A picture of characters. What does not fit is cut off, so that nothing ever wraps.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

namespace search_and_track {

enum class Colour : std::uint8_t { plain, red, green, yellow, magenta, cyan };

struct Style {
  Colour colour = Colour::plain;
  bool bold = false;
  bool dim = false;
  bool filled = false;  // the colour is the background's

  bool operator==(const Style&) const = default;
};

inline constexpr Style kBold{.bold = true};
inline constexpr Style kDim{.dim = true};

class Canvas {
 public:
  Canvas(int rows, int columns);

  [[nodiscard]] int columns() const { return columns_; }
  // Text in UTF-8; each of its characters takes one cell. Returns the column after it.
  int put(int row, int column, std::string_view text, Style style = {});
  // `count` times the same character.
  void repeat(int row, int column, int count, std::string_view character, Style style = {});

  // For a terminal: every row is placed, and nothing scrolls. Cut to `rows` and `columns`.
  [[nodiscard]] std::string drawn(int rows, int columns, bool coloured) const;

 private:
  struct Cell {
    std::string character = " ";
    Style style;
  };
  [[nodiscard]] std::size_t index(int row, int column) const {
    return static_cast<std::size_t>(row) * static_cast<std::size_t>(columns_) +
           static_cast<std::size_t>(column);
  }

  int rows_;
  int columns_;
  std::vector<Cell> cells_;
};

}  // namespace search_and_track
