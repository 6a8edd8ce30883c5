#include "canvas.hpp"

#include <algorithm>
#include <array>

namespace search_and_track {
namespace {

constexpr std::string_view kReset = "\x1b[0m";

// The terminal's own colours, so that they suit its background.
int colour_number(Colour colour) {
  constexpr std::array<int, 6> kNumbers{9, 1, 2, 3, 5, 6};
  return kNumbers[static_cast<std::size_t>(colour)];
}

std::string escape_for(Style style, bool coloured) {
  std::string codes = "0";
  if (style.bold) codes += ";1";
  if (style.dim) codes += ";2";
  if (style.filled && !coloured) codes += ";7";
  if (coloured && style.colour != Colour::plain) {
    codes += style.filled ? ";30;4" : ";3";
    codes += std::to_string(colour_number(style.colour));
  }
  return "\x1b[" + codes + "m";
}

std::size_t length_of_character(std::string_view text) {
  std::size_t length = 1;
  while (length < text.size() && (static_cast<unsigned char>(text[length]) & 0xc0) == 0x80) {
    ++length;
  }
  return length;
}

}  // namespace

Canvas::Canvas(int rows, int columns)
    : rows_(rows),
      columns_(columns),
      cells_(static_cast<std::size_t>(rows) * static_cast<std::size_t>(columns)) {}

int Canvas::put(int row, int column, std::string_view text, Style style) {
  while (!text.empty()) {
    const std::size_t length = length_of_character(text);
    if (row >= 0 && row < rows_ && column >= 0 && column < columns_) {
      cells_[index(row, column)] = {std::string(text.substr(0, length)), style};
    }
    text.remove_prefix(length);
    ++column;
  }
  return column;
}

void Canvas::repeat(int row, int column, int count, std::string_view character, Style style) {
  for (int i = 0; i < count; ++i) put(row, column + i, character, style);
}

std::string Canvas::drawn(int rows, int columns, bool coloured) const {
  std::string result;
  for (int row = 0; row < std::min(rows, rows_); ++row) {
    result += "\x1b[" + std::to_string(row + 1) + ";1H";
    Style style;
    for (int column = 0; column < std::min(columns, columns_); ++column) {
      const Cell& next = cells_[index(row, column)];
      if (next.style != style) result += escape_for(next.style, coloured);
      style = next.style;
      result += next.character;
    }
    result += kReset;
    if (columns > columns_) result += "\x1b[K";
  }
  return result + "\x1b[1;1H";  // what somebody types is soon drawn over there
}

}  // namespace search_and_track
