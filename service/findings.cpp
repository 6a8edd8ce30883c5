#include "service/findings.hpp"

#include <algorithm>

#include "service/log.hpp"

namespace arbiter::service {
namespace {

std::string place(const rules::Location& where) {
  return where.file + ":" + std::to_string(where.line) + ":" + std::to_string(where.column);
}

}  // namespace

void log_findings(const rules::Diagnostics& diagnostics) {
  for (const rules::Diagnostic& finding : diagnostics.items()) {
    const auto level = finding.severity == rules::Severity::kError     ? log::level::err
                       : finding.severity == rules::Severity::kWarning ? log::level::warn
                                                                       : log::level::info;
    log::log(level, "{}: {} [{}]", place(finding.where), finding.message, finding.code);
  }
}

std::string first_error(const rules::Diagnostics& diagnostics) {
  const auto is_error = [](const rules::Diagnostic& finding) {
    return finding.severity == rules::Severity::kError;
  };
  const auto& items = diagnostics.items();
  const auto first = std::find_if(items.begin(), items.end(), is_error);
  if (first == items.end()) return "more than can be shown";
  const auto more = std::count_if(first + 1, items.end(), is_error);
  return place(first->where) + ": " + first->message +
         (more == 0 ? "" : " (and " + std::to_string(more) + " more; see the log)");
}

}  // namespace arbiter::service
