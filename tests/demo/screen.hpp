// As much of a terminal as is needed to see what a program drew.
#pragma once

#include <algorithm>
#include <cctype>
#include <cstdlib>
#include <string>
#include <string_view>
#include <vector>

namespace arbiter::test {

class Screen {
 public:
  Screen(int rows, int columns)
      : rows_(rows),
        columns_(columns),
        cells_(static_cast<std::size_t>(rows),
               std::vector<std::string>(static_cast<std::size_t>(columns), " ")) {}

  // May end in the middle of an escape sequence; the next text goes on from there.
  void write(std::string_view text) {
    unread_ += text;
    std::size_t next = 0;
    while (next < unread_.size()) {
      const std::size_t length =
          unread_[next] == '\x1b' ? escape_length(next) : character_length(next);
      if (next + length > unread_.size()) break;
      const std::string piece = unread_.substr(next, length);
      next += length;
      if (piece[0] == '\x1b') {
        obey(piece);
      } else if (static_cast<unsigned char>(piece[0]) >= ' ') {
        show(piece);
      }
    }
    unread_.erase(0, next);
  }

  [[nodiscard]] std::string row(int index) const {
    std::string text;
    for (const auto& cell : cells_[static_cast<std::size_t>(index)]) text += cell;
    text.erase(text.find_last_not_of(' ') + 1);
    return text;
  }
  [[nodiscard]] std::string text() const {
    std::string all;
    for (int i = 0; i < rows_; ++i) all += row(i) + "\n";
    return all;
  }

  [[nodiscard]] bool has_overflown() const { return overflown_; }
  [[nodiscard]] bool is_alternate() const { return alternate_; }
  [[nodiscard]] bool has_cursor() const { return cursor_; }
  [[nodiscard]] bool wraps() const { return wraps_; }
  [[nodiscard]] bool has_had_colour() const { return coloured_; }
  // The sequences that it does not know.
  [[nodiscard]] const std::string& not_understood() const { return not_understood_; }

 private:
  [[nodiscard]] std::size_t escape_length(std::size_t from) const {
    std::size_t end = from + 2;
    while (end < unread_.size() && std::isalpha(static_cast<unsigned char>(unread_[end])) == 0) {
      ++end;
    }
    return end + 1 - from;
  }
  [[nodiscard]] std::size_t character_length(std::size_t from) const {
    const auto first = static_cast<unsigned char>(unread_[from]);
    return first < 0x80 ? 1 : first < 0xe0 ? 2 : first < 0xf0 ? 3 : 4;
  }

  void obey(const std::string& escape) {
    const std::string codes = escape.substr(2, escape.size() - 3);
    const bool on = escape.back() == 'h';
    if (codes == "?25") {
      cursor_ = on;
    } else if (codes == "?7") {
      wraps_ = on;
    } else if (codes == "?1049") {
      alternate_ = on;
    } else if (escape.back() == 'H') {
      row_ = std::atoi(codes.c_str()) - 1;
      column_ = std::atoi(codes.substr(codes.find(';') + 1).c_str()) - 1;
    } else if (escape.back() == 'm') {
      coloured_ = coloured_ || codes.find(";3") != std::string::npos ||
                  codes.find(";4") != std::string::npos;
    } else if (escape.back() == 'J') {
      for (auto& cells : cells_) std::fill(cells.begin(), cells.end(), " ");
    } else if (escape.back() != 'K') {
      not_understood_ += escape.substr(1) + " ";
    }
  }

  void show(const std::string& character) {
    if (!alternate_) return;
    if (row_ < 0 || row_ >= rows_ || column_ < 0 || column_ >= columns_) {
      overflown_ = true;
    } else {
      cells_[static_cast<std::size_t>(row_)][static_cast<std::size_t>(column_)] = character;
    }
    ++column_;
  }

  int rows_;
  int columns_;
  std::vector<std::vector<std::string>> cells_;
  std::string unread_;
  int row_ = 0;
  int column_ = 0;
  bool overflown_ = false;
  bool alternate_ = false;
  bool cursor_ = true;
  bool wraps_ = true;
  bool coloured_ = false;
  std::string not_understood_;
};

}  // namespace arbiter::test
