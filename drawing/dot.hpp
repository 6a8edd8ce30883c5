// The language of Graphviz: how text gets into it unharmed, and what all pictures look alike in.
#pragma once

#include <cstddef>
#include <initializer_list>
#include <string>
#include <string_view>
#include <utility>

#include "rules/text/diagnostic.hpp"

namespace arbiter::drawing {

// Eight colours that people with any kind of colour blindness can tell apart (Okabe and Ito), and
// paler ones of the same hues to write on. Nothing is said by colour alone.
namespace colour {
inline constexpr const char* kInhibition = "#D55E00";  // a red that is no green to anybody
inline constexpr const char* kSensed = "#0072B2";
inline constexpr const char* kWins = "#009E73";
inline constexpr const char* kOverridden = "#E69F00";
inline constexpr const char* kPlain = "#444444";
inline constexpr const char* kSilent = "#999999";
inline constexpr const char* kPaleWins = "#BFE8DC";
inline constexpr const char* kPaleOverridden = "#FCE7BF";
inline constexpr const char* kPaleActive = "#CDE8F8";
inline constexpr const char* kPaper = "#FFFFFF";
inline constexpr const char* kShade = "#E4E4E4";
}  // namespace colour

// In double quotes, for ids, tooltips and plain labels: nothing in it has a meaning to Graphviz.
std::string quoted(std::string_view text);

// For labels that are tables. Bytes that are no UTF-8 and control characters are made visible, for
// Graphviz stops at them.
std::string html(std::string_view text);

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
  [[nodiscard]] std::string take() { return std::move(text_); }

 private:
  void indent();

  std::string text_;
  std::size_t depth_ = 0;
};

}  // namespace arbiter::drawing
