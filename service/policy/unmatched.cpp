#include "service/policy/unmatched.hpp"

#include <algorithm>
#include <string>

#include "rules/model/quantifiers.hpp"
#include "rules/text/names.hpp"

namespace arbiter::service {
namespace {

using Names = std::vector<std::string_view>;

void sort(Names& names) {
  std::sort(names.begin(), names.end());
  names.erase(std::unique(names.begin(), names.end()), names.end());
}

// There may be a thousand patterns and a hundred thousand names: only those are looked at that
// begin as the pattern does.
bool matches_one(std::string_view glob, const Names& names) {
  const std::string_view beginning = glob.substr(0, glob.find('*'));
  const auto first = std::lower_bound(names.begin(), names.end(), beginning);
  for (auto name = first; name != names.end() && name->starts_with(beginning); ++name) {
    if (rules::matches(glob, *name)) return true;
  }
  return false;
}

}  // namespace

void find_unmatched(const Policy& policy, NamedPorts ports, rules::Diagnostics& diagnostics) {
  sort(ports.outputs);
  sort(ports.inputs);
  Names all = ports.outputs;
  all.insert(all.end(), ports.inputs.begin(), ports.inputs.end());
  sort(all);
  std::size_t suggestions = 0;
  for (const Policy::Pattern& pattern : policy.patterns()) {
    const bool on_both = pattern.is_on_outputs && pattern.is_on_inputs;
    const Names& candidates = on_both ? all : pattern.is_on_outputs ? ports.outputs : ports.inputs;
    if (candidates.empty() || matches_one(pattern.glob, candidates)) continue;
    const std::string kind = on_both                 ? "a port"
                             : pattern.is_on_outputs ? "an output port"
                                                     : "an input port";
    const bool may_suggest =
        pattern.glob.find('*') == std::string_view::npos && ++suggestions <= rules::kMaxSuggestions;
    std::string message = "no model has " + kind + " that matches " + rules::quote(pattern.glob);
    message +=
        rules::advise(pattern.glob, may_suggest ? candidates : Names{},
                      "correct or remove it; `arbiter rules MODEL` shows the ports of a model");
    diagnostics.warning("matches-nothing", *pattern.where, std::move(message));
  }
}

}  // namespace arbiter::service
