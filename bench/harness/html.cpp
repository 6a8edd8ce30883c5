#include "bench/harness/html.hpp"

#include <string_view>

#include "bench_page.hpp"  // made from bench/report/

namespace arbiter::bench {

std::string script_text(const nlohmann::json& json) {
  // Notes may hold what another system has said, in whatever encoding.
  const std::string text = json.dump(-1, ' ', false, nlohmann::json::error_handler_t::replace);
  std::string safe;
  safe.reserve(text.size());
  for (const char c : text) {
    // In JSON, "<" stands in strings only; escaped it can neither end the script nor begin a
    // comment.
    if (c == '<') {
      safe += "\\u003c";
    } else {
      safe += c;
    }
  }
  return safe;
}

std::string html(const nlohmann::json& report) {
  const std::pair<std::string_view, std::string> parts[] = {
      {"{{page.css}}", page_css},
      {"{{report.json}}", script_text(report)},
      {"{{scripts}}", std::string(format_js) + charts_js + page_js},
  };
  std::string page;
  std::string_view rest = page_html;
  // In the order in which they stand in the page, so that nothing is looked for in what was
  // inserted.
  for (const auto& [name, text] : parts) {
    const auto at = rest.find(name);
    page.append(rest.substr(0, at)).append(text);
    rest.remove_prefix(at + name.size());
  }
  return page.append(rest);
}

}  // namespace arbiter::bench
