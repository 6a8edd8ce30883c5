#include "cli/name_warnings.hpp"

#include <algorithm>
#include <array>
#include <cstddef>
#include <string_view>

#include "rules/text/names.hpp"

namespace arbiter::cli {
namespace {

constexpr std::size_t kMaxShown = 4;
constexpr std::array<std::string_view, 6> kCodes{"matches-nothing", "never-published", "never-read",
                                                 "pattern-as-name", "similar-name",    "wrong-end"};

}  // namespace

std::vector<rules::Diagnostic> name_warnings(const rules::Diagnostics& found) {
  std::vector<rules::Diagnostic> result;
  for (const rules::Diagnostic& item : found.items()) {
    if (std::find(kCodes.begin(), kCodes.end(), item.code) != kCodes.end()) result.push_back(item);
  }
  return result;
}

void write_text(std::ostream& out, const std::vector<rules::Diagnostic>& warnings) {
  for (std::size_t i = 0; i < std::min(warnings.size(), kMaxShown); ++i) {
    out << (i == 0 ? "\n" : "") << "warning: " << rules::describe(warnings[i].where) << ": "
        << warnings[i].message << " [" << warnings[i].code << "]\n";
  }
  if (warnings.size() > kMaxShown) {
    out << "and " << warnings.size() - kMaxShown << " more of the kind; arbiter check shows all\n";
  }
}

nlohmann::json to_json(const std::vector<rules::Diagnostic>& warnings) {
  nlohmann::json result = nlohmann::json::array();
  for (const rules::Diagnostic& warning : warnings) {
    result.push_back({{"code", warning.code},
                      {"file", warning.where.file},
                      {"line", warning.where.line},
                      {"column", warning.where.column},
                      {"message", warning.message}});
  }
  return result;
}

}  // namespace arbiter::cli
