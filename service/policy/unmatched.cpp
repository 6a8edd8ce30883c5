#include "service/policy/unmatched.hpp"

#include <algorithm>
#include <string>

#include "rules/model/quantifiers.hpp"
#include "rules/text/names.hpp"

namespace arbiter::service {
namespace {

using Names = std::vector<std::string_view>;

// What the tools of this project publish: no model need name it.
constexpr std::string_view kOurs = "/arbiter/";
// Bytes compared, at most: less than a second.
constexpr std::size_t kMostSteps = 200'000'000;

void sort(Names& names) {
  std::sort(names.begin(), names.end());
  names.erase(std::unique(names.begin(), names.end()), names.end());
}

// Whether a name fits the pattern. There may be a thousand patterns, a hundred thousand names, and
// many '*': only those names are looked at that begin as the pattern does, and once `steps` are
// used up none is.
bool fits_one(std::string_view glob, const Names& names, std::size_t& steps) {
  const std::string_view beginning = glob.substr(0, glob.find('*'));
  const auto first = std::lower_bound(names.begin(), names.end(), beginning);
  for (auto name = first; name != names.end() && name->starts_with(beginning); ++name) {
    const std::size_t most = glob.size() * name->size();
    if (steps < most) {
      steps = 0;
      return true;
    }
    steps -= most;
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
  std::size_t steps = kMostSteps;
  for (const Policy::Pattern& pattern : policy.patterns()) {
    const bool on_both = pattern.is_on_outputs && pattern.is_on_inputs;
    const Names& candidates = on_both ? all : pattern.is_on_outputs ? ports.outputs : ports.inputs;
    const bool is_ours = pattern.glob.starts_with(kOurs);
    if (candidates.empty() || is_ours || fits_one(pattern.glob, candidates, steps)) continue;
    const std::string kind = on_both                 ? "a port"
                             : pattern.is_on_outputs ? "an output port"
                                                     : "an input port";
    const bool may_suggest =
        pattern.glob.find('*') == std::string_view::npos && ++suggestions <= rules::kMaxSuggestions;
    std::string message = "no model names " + kind + " that fits " + rules::quote(pattern.glob);
    message += rules::advise(pattern.glob, may_suggest ? candidates : Names{},
                             "correct it, unless components open such a port that no model needs");
    diagnostics.note("no-such-port", *pattern.where, std::move(message));
  }
}

}  // namespace arbiter::service
