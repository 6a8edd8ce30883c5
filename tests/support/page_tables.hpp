// The tables of a page of documentation, for tests that hold the page to the code.
#pragma once

#include <optional>
#include <sstream>
#include <string>
#include <string_view>
#include <vector>

namespace arbiter::test {

struct PageRow {
  int line = 0;
  std::string section;  // the heading above the table
  std::vector<std::string> cells;
};

namespace page_detail {

inline std::string trimmed(std::string_view text) {
  const auto first = text.find_first_not_of(' ');
  if (first == std::string_view::npos) return {};
  return std::string(text.substr(first, text.find_last_not_of(' ') - first + 1));
}

inline std::vector<std::string> cells_of(const std::string& line) {
  std::vector<std::string> cells;
  std::istringstream text(line.substr(1));
  for (std::string cell; std::getline(text, cell, '|');) cells.push_back(trimmed(cell));
  return cells;
}

}  // namespace page_detail

// What stands between backticks, in order.
inline std::vector<std::string> quoted(const std::string& text) {
  std::vector<std::string> result;
  auto begin = text.find('`');
  while (begin != std::string::npos) {
    const auto end = text.find('`', begin + 1);
    if (end == std::string::npos) break;
    result.push_back(text.substr(begin + 1, end - begin - 1));
    begin = text.find('`', end + 1);
  }
  return result;
}

// The rows of all tables that are headed by these cells.
inline std::vector<PageRow> rows_of(const std::string& page, const std::vector<std::string>& head) {
  std::vector<PageRow> rows;
  std::istringstream text(page);
  std::string section;
  bool inside = false;
  int number = 0;
  for (std::string line; std::getline(text, line);) {
    ++number;
    if (line.starts_with('#')) section = line.substr(line.find_first_not_of("# "));
    if (!line.starts_with('|')) {
      inside = false;
    } else if (const auto cells = page_detail::cells_of(line); cells == head) {
      inside = true;
    } else if (inside && !line.starts_with("| ---")) {
      rows.push_back({number, section, cells});
    }
  }
  return rows;
}

// What a page's listing of that kind holds (```json), if there is one.
inline std::optional<std::string> listing_of(const std::string& page, const std::string& kind) {
  const std::string fence = "\n```" + kind + "\n";
  const auto begin = page.find(fence);
  if (begin == std::string::npos) return {};
  const auto end = page.find("\n```\n", begin + fence.size());
  return page.substr(begin + fence.size(), end - begin - fence.size() + 1);
}

}  // namespace arbiter::test
