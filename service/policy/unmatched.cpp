#include "service/policy/unmatched.hpp"

#include <algorithm>
#include <optional>
#include <string>
#include <utility>

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

// Of a pattern with '*': the one that was probably meant, where what stands before the first '*'
// resembles the beginning of some names; and fits one, if it goes on in the same way. In whole
// parts of names: "/Operator/*" for "/Opertor/*".
std::optional<std::string> find_meant(std::string_view glob, const Names& names,
                                      std::size_t& steps) {
  std::string_view beginning = glob.substr(0, glob.find('*'));
  if (beginning.ends_with('/')) beginning.remove_suffix(1);
  const auto parts = std::count(beginning.begin(), beginning.end(), '/');
  Names known;
  for (const std::string_view name : names) {
    std::size_t end = 0;
    for (auto i = parts; i > 0 && end != name.npos; --i) end = name.find('/', end + 1);
    if (end == name.npos) continue;
    const std::string_view part = name.substr(0, end);
    if (known.empty() || known.back() != part) known.push_back(part);
  }
  const auto similar = rules::find_similar(beginning, known);
  if (!similar || *similar == beginning) return std::nullopt;
  std::string meant = *similar + std::string(glob.substr(beginning.size()));
  const bool fits = steps > 0 && fits_one(meant, names, steps) && steps > 0;
  return fits ? std::optional(std::move(meant)) : std::nullopt;
}

// What to do about a pattern that fits none of the names. `suggestions`: how many were looked for.
std::string advice_on_pattern(std::string_view glob, const Names& names, std::size_t& suggestions,
                              std::size_t& steps) {
  constexpr std::string_view kOtherwise =
      "correct it, unless components open such a port that no model needs";
  const bool may_suggest = ++suggestions <= rules::kMaxSuggestions;
  if (glob.find('*') == glob.npos) {
    return rules::advise(glob, may_suggest ? names : Names{}, kOtherwise);
  }
  const auto meant = may_suggest ? find_meant(glob, names, steps) : std::nullopt;
  return meant ? "; did you mean " + rules::quote(*meant) + "?" : "; " + std::string(kOtherwise);
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
    diagnostics.note("no-such-port", *pattern.where,
                     "no model names " + kind + " that fits " + rules::quote(pattern.glob) +
                         advice_on_pattern(pattern.glob, candidates, suggestions, steps));
  }
}

}  // namespace arbiter::service
