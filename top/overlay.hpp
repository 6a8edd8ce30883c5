// A text that covers the tables until it is closed: an explanation, or the help.
#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "top/line.hpp"

namespace arbiter::top {

class Overlay {
 public:
  Overlay(std::string title, std::vector<std::string> lines)
      : title_(std::move(title)), lines_(std::move(lines)) {}

  void scroll(std::ptrdiff_t by);
  // Its lines, broken where they are too long. As many as `height`.
  [[nodiscard]] std::vector<Line> draw(std::size_t width, std::size_t height, Charset charset);
  [[nodiscard]] std::size_t page() const { return page_; }

 private:
  void break_lines(std::size_t width, Charset charset);

  const std::string title_;
  const std::vector<std::string> lines_;
  std::vector<std::string> parts_;  // of the lines, broken for a screen of this width
  std::optional<std::pair<std::size_t, Charset>> broken_for_;
  std::size_t offset_ = 0;
  std::size_t most_ = 0;  // that it can be scrolled to
  std::size_t page_ = 1;
};

// Each at most so many columns wide, broken at blanks where there are any. What continues a line is
// indented as that was, and by two more; of a line "term   what it means" it stands below the
// meaning.
[[nodiscard]] std::vector<std::string> broken(const std::string& line, std::size_t columns,
                                              Charset charset);

}  // namespace arbiter::top
