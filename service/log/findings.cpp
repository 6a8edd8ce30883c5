#include "service/log/findings.hpp"

#include <algorithm>
#include <cstddef>
#include <map>
#include <sstream>

#include <nlohmann/json.hpp>

#include "rules/ask/report.hpp"
#include "service/log/log.hpp"

namespace arbiter::service {
namespace {

// Of one code, in one model. What is true of a thousand ports need not fill the log.
constexpr std::size_t kMaxLogged = 20;

log::level::level_enum level_of(rules::Severity severity) {
  return severity == rules::Severity::kError     ? log::level::err
         : severity == rules::Severity::kWarning ? log::level::warn
                                                 : log::level::info;
}

void log_findings(const std::string& of, const rules::Diagnostics& diagnostics) {
  std::map<std::pair<rules::Severity, std::string>, std::size_t> logged;
  for (const rules::Diagnostic& finding : diagnostics.items()) {
    if (++logged[{finding.severity, finding.code}] > kMaxLogged) continue;
    log::log(level_of(finding.severity), "{}: {} [{}]", describe(finding.where), finding.message,
             finding.code);
  }
  for (const auto& [kind, kept] : logged) {
    const std::size_t found = diagnostics.count(kind.first, kind.second);
    if (found <= kMaxLogged) continue;
    log::log(level_of(kind.first), "{} more [{}]{}", found - kMaxLogged, kind.second,
             of == kOfPolicy ? "" : "; arbiter check shows them");
  }
}

bool is_error(const rules::Diagnostic& finding) {
  return finding.severity == rules::Severity::kError;
}

}  // namespace

void Findings::add(std::string of, rules::Diagnostics diagnostics) {
  had_errors_ |= diagnostics.has_errors();
  if (takes_warnings_for_errors_) diagnostics.make_warnings_errors();
  log_findings(of, diagnostics);
  const auto part =
      std::find_if(parts_.begin(), parts_.end(), [&](const Part& each) { return each.of == of; });
  if (part != parts_.end()) return part->diagnostics.add(std::move(diagnostics));
  parts_.push_back({std::move(of), std::move(diagnostics)});
}

void Findings::add_failure(std::string why) {
  log::error("{}", why);
  had_errors_ = true;
  failures_.push_back(std::move(why));
}

bool Findings::has_errors() const {
  return !failures_.empty() || std::any_of(parts_.begin(), parts_.end(), [](const Part& part) {
    return part.diagnostics.has_errors();
  });
}

std::string Findings::why_refused() const {
  return std::string("the files have errors, listed above") +
         (had_errors_ ? "" : "; --strict treats warnings as errors");
}

std::string Findings::first_error() const {
  std::string first;
  std::size_t count = failures_.size();
  if (count != 0) first = failures_.front();
  for (const Part& part : parts_) {
    const auto& items = part.diagnostics.items();
    const auto found = std::find_if(items.begin(), items.end(), is_error);
    if (found == items.end()) continue;
    if (count == 0) {
      first = part.of + " has errors: " + describe(found->where) + ": " + found->message;
    }
    count += part.diagnostics.count(rules::Severity::kError);
  }
  if (count > 1) first += " (and " + std::to_string(count - 1) + " more; see the log)";
  return first;
}

std::string Findings::text() const {
  std::ostringstream text;
  for (const std::string& why : failures_) text << "error: " << why << '\n';
  for (const Part& part : parts_) {
    if (part.diagnostics.items().empty()) continue;
    if (parts_.size() > 1) text << part.of << ":\n";
    rules::write_text(text, part.diagnostics);
  }
  return text.str();
}

nlohmann::json Findings::json() const {
  nlohmann::json result = nlohmann::json::array();
  for (const std::string& why : failures_) {
    result.push_back({{"of", why}, {"findings", nlohmann::json::array()}});
  }
  for (const Part& part : parts_) {
    std::ostringstream text;
    rules::write_json(text, part.diagnostics);
    result.push_back({{"of", part.of}, {"findings", nlohmann::json::parse(text.str())}});
  }
  return result;
}

}  // namespace arbiter::service
