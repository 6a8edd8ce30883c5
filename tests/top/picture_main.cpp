// Draws the screen of a program as SVG: runs it in an emulated terminal, until a text has been on
// the screen and some time has passed.
//
//   top-picture SECONDS FILE.svg COMMAND ARGUMENT...
#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <iostream>
#include <string>
#include <vector>

#include "tests/support/emulated_terminal.hpp"

namespace {

using arbiter::test::EmulatedTerminal;

constexpr double kWide = 8.4;
constexpr double kHigh = 17;
constexpr double kMargin = 12;

std::string escaped(const std::string& text) {
  std::string result;
  for (const char each : text) {
    result += each == '<'   ? "&lt;"
              : each == '>' ? "&gt;"
              : each == '&' ? "&amp;"
                            : std::string(1, each);
  }
  return result;
}

// Those of a dark terminal.
std::string colour_of(const VTermScreenCell& cell) {
  if (VTERM_COLOR_IS_DEFAULT_FG(&cell.fg)) return "#d8dee9";
  static const std::vector<std::string> kPalette = {"#3b4252", "#ec6b76", "#8fd18f", "#f0c674",
                                                    "#81a1c1", "#b48ead", "#6fd0e0", "#e5e9f0"};
  const auto index = VTERM_COLOR_IS_INDEXED(&cell.fg) ? cell.fg.indexed.idx % 8u : 7u;
  return kPalette[index];
}

std::string number(double value) {
  char text[32];
  std::snprintf(text, sizeof text, "%.1f", value);
  return text;
}

// Runs of cells that look the same.
void draw_row(std::ostream& out, const EmulatedTerminal& terminal, int row) {
  const int columns = terminal.size().columns;
  const auto look = [&](int column) {
    const VTermScreenCell cell = terminal.cell(row, column);
    const bool is_reverse = cell.attrs.reverse != 0;
    return (is_reverse ? std::string("#1b2028") : colour_of(cell)) + (cell.attrs.bold ? "b" : "-") +
           (is_reverse ? "r" : "-") + (cell.attrs.underline ? "u" : "-");
  };
  for (int from = 0; from < columns;) {
    int to = from;
    std::string text;
    const std::string same = look(from);
    for (; to < columns && look(to) == same; ++to) {
      const VTermScreenCell cell = terminal.cell(row, to);
      text += cell.chars[0] == 0 ? " " : arbiter::shm::encode_utf8(cell.chars[0]);
    }
    const double x = kMargin + from * kWide;
    const double y = kMargin + row * kHigh;
    if (same[8] == 'r') {
      out << "<rect x=\"" << number(x) << "\" y=\"" << number(y) << "\" width=\""
          << number((to - from) * kWide) << "\" height=\"" << kHigh << "\" fill=\"#d8dee9\"/>\n";
    }
    if (text.find_first_not_of(' ') != std::string::npos) {
      out << "<text x=\"" << number(x) << "\" y=\"" << number(y + 13) << "\" textLength=\""
          << number((to - from) * kWide) << "\" fill=\"" << same.substr(0, 7) << '"'
          << (same[7] == 'b' ? " font-weight=\"bold\"" : "")
          << (same[9] == 'u' ? " text-decoration=\"underline\"" : "") << '>' << escaped(text)
          << "</text>\n";
    }
    from = to;
  }
}

void draw(std::ostream& out, const EmulatedTerminal& terminal) {
  const double width = 2 * kMargin + terminal.size().columns * kWide;
  const double height = 2 * kMargin + terminal.size().rows * kHigh;
  out << "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 " << number(width) << ' '
      << number(height) << "\" font-family=\"DejaVu Sans Mono, Menlo, Consolas, monospace\" "
      << "font-size=\"14\" xml:space=\"preserve\">\n"
      << "<rect width=\"100%\" height=\"100%\" rx=\"8\" fill=\"#1b2028\"/>\n";
  for (int row = 0; row < terminal.size().rows; ++row) draw_row(out, terminal, row);
  out << "</svg>\n";
}

}  // namespace

int main(int argc, char** argv) {
  if (argc < 4) {
    std::cerr << "Usage: top-picture SECONDS FILE.svg COMMAND ARGUMENT...\n";
    return 2;
  }
  const auto end = std::chrono::steady_clock::now() +
                   std::chrono::milliseconds(static_cast<int>(std::atof(argv[1]) * 1000));
  EmulatedTerminal terminal({argv + 3, argv + argc}, {{"TERM", "xterm-256color"}}, {24, 96});
  terminal.wait_until([&] { return std::chrono::steady_clock::now() >= end; });
  std::ofstream file(argv[2]);
  draw(file, terminal);
  std::cout << terminal.text();
  terminal.type("q");
  terminal.wait_for_end();
  return file.flush() ? 0 : 2;
}
