#include "cli/why_summary.hpp"

#include <algorithm>
#include <cstddef>
#include <map>
#include <set>
#include <string>

#include "cli/why_report.hpp"
#include "rules/text/names.hpp"

namespace arbiter::cli {
namespace {

using rules::ConnectionExplanation;

constexpr std::size_t kMaxReasons = 5;  // lines

// All that by themselves keep it out, without what differs from one connection to the next.
std::set<std::string> causes_by_themselves(const ConnectionExplanation& connection) {
  if (!connection.has_rule) return {"selected by no rule"};
  if (connection.earlier) {
    return {"behind " + *connection.earlier + " in the model, which wins by conflict=\"first\""};
  }
  if (connection.parts.size() != 1) return {"kept out by their behaviours, for a reason each"};
  std::set<std::string> reasons;
  for (const auto& cause : connection.parts.front().causes) reasons.insert(headline(cause));
  return reasons;
}

void write_group(std::ostream& out, const std::string& reason,
                 const std::vector<std::string>& sources) {
  out << "  " << sources.size() << ' ' << reason << ": " << rules::enumerate(sources) << '\n';
}

// Each is told of once, by the reason that it shares with most of those that are left.
void write_active(std::ostream& out, const std::vector<const ConnectionExplanation*>& active) {
  std::map<const ConnectionExplanation*, std::set<std::string>> left;
  for (const auto* each : active) left.emplace(each, causes_by_themselves(*each));
  for (std::size_t line = 0; line < kMaxReasons && !left.empty(); ++line) {
    std::map<std::string, std::size_t> counts;
    for (const auto& [connection, reasons] : left) {
      for (const auto& reason : reasons) ++counts[reason];
    }
    const auto most =
        std::max_element(counts.begin(), counts.end(),
                         [](const auto& a, const auto& b) { return a.second < b.second; });
    if (most == counts.end()) break;
    std::vector<std::string> sources;
    for (const auto* each : active) {
      const auto found = left.find(each);
      if (found == left.end() || found->second.count(most->first) == 0) continue;
      sources.push_back(each->source);
      left.erase(found);
    }
    write_group(out, most->first, sources);
  }
  std::vector<std::string> others;
  for (const auto* each : active) {
    if (left.count(each) != 0) others.push_back(each->source);
  }
  if (!others.empty()) write_group(out, "for other reasons", others);
}

}  // namespace

void write_summary(std::ostream& out,
                   const std::vector<const ConnectionExplanation*>& connections) {
  std::vector<const ConnectionExplanation*> active;
  std::vector<std::string> inactive;
  for (const auto* each : connections) {
    if (each->is_active || !each->has_rule) {
      active.push_back(each);
    } else {
      inactive.push_back(each->source);
    }
  }
  if (!active.empty()) {
    out << '\n'
        << active.size() << " more " << (active.size() == 1 ? "is" : "are")
        << " kept out by the rules:\n";
    write_active(out, active);
  }
  if (!inactive.empty()) {
    out << '\n'
        << inactive.size() << " more " << (inactive.size() == 1 ? "is" : "are")
        << " inactive: " << rules::enumerate(inactive) << '\n';
  }
}

}  // namespace arbiter::cli
