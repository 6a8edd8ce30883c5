// The language of Graphviz: how text gets into it unharmed.
#pragma once

#include <cstddef>
#include <initializer_list>
#include <set>
#include <string>
#include <string_view>
#include <utility>

#include "drawing/look.hpp"
#include "rules/text/diagnostic.hpp"

namespace arbiter::drawing {

// In double quotes, for ids, tooltips and plain labels: nothing in it has a meaning to Graphviz.
std::string quoted(std::string_view text);

// For labels that are tables. Bytes that are no UTF-8 and control characters are made visible, for
// Graphviz stops at them.
std::string html(std::string_view text);

// Parts of such labels, of content that is safe already: small print, and a row of one cell.
std::string small(const std::string& content, const char* colour = nullptr);
std::string row(const std::string& content);

// html() of several lines, which all begin at the left.
std::string html_lines(std::string_view text);

// "file:line"
std::string place(const rules::Location& where);

// Lines of DOT, indented by the depth of their subgraph.
class DotWriter {
 public:
  using Attributes = std::initializer_list<std::pair<std::string_view, std::string>>;

  void open(std::string_view what);  // "digraph x" becomes "digraph x {"
  void close();
  // Values are written as they are: a number, a word, quoted(), or a table in angle brackets.
  void statement(std::string_view what, Attributes attributes = {});
  void attribute(std::string_view name, std::string_view value);
  // A statement that looks as such lines do, and is noted for the legend.
  void line(LineKind kind, std::string_view what, Attributes attributes = {});
  [[nodiscard]] const std::set<LineKind>& lines() const { return lines_; }
  [[nodiscard]] std::size_t line_count() const { return line_count_; }
  // Signs that occur, for the legend as well.
  void note_sign(std::string_view sign) { signs_.insert(sign); }
  [[nodiscard]] bool has_sign(std::string_view sign) const { return signs_.contains(sign); }
  [[nodiscard]] std::string take() { return std::move(text_); }

 private:
  void indent();
  void statement(std::string_view what, std::initializer_list<Attributes> lists);

  std::string text_;
  std::size_t depth_ = 0;
  std::set<LineKind> lines_;
  std::size_t line_count_ = 0;
  std::set<std::string_view> signs_;
};

}  // namespace arbiter::drawing
