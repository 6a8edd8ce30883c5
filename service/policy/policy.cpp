#include "service/policy/policy.hpp"

#include <algorithm>
#include <utility>

#include "rules/model/quantifiers.hpp"

namespace arbiter::service {
namespace {

constexpr std::uint16_t bit(Action action) {
  return static_cast<std::uint16_t>(1u << static_cast<unsigned>(action));
}

constexpr std::uint16_t kOnOutputs =
    bit(Action::kOutput) | bit(Action::kDeactivate) | bit(Action::kReplay) | bit(Action::kTap);
constexpr std::uint16_t kOnInputs = bit(Action::kInput) | bit(Action::kTap);
constexpr std::uint16_t kOnPorts = kOnOutputs | kOnInputs;

bool is_about_a_port(Action action) { return (kOnPorts & bit(action)) != 0; }

// A glob whose only '*' is its last byte, or that has none.
bool is_prefix(std::string_view glob) { return glob.find('*') >= glob.size() - 1; }

// Whether all that `later` matches, `earlier` does. May miss it, never claims it wrongly.
bool glob_covers(std::string_view earlier, std::string_view later) {
  if (earlier == later) return true;
  return earlier.ends_with('*') && is_prefix(earlier) &&
         later.starts_with(earlier.substr(0, earlier.size() - 1));
}

}  // namespace

Policy::Policy(uid_t owner) : owner_(owner) {
  // Whoever may open an output port could end its activity by opening it, too.
  constexpr auto kUse = bit(Action::kOutput) | bit(Action::kInput) | bit(Action::kDeactivate);
  rules_.push_back({true, {}, kUse, "*", 1, "allow everyone output,input,deactivate *", {}});
  rules_.push_back({true, {}, bit(Action::kObserve), "*", 2, "allow everyone observe", {}});
}

bool Policy::Subject::includes(const Identity& who) const {
  switch (kind) {
    case Kind::kUser:
      return who.user == id;
    case Kind::kGroup:
      return std::find(who.groups.begin(), who.groups.end(), id) != who.groups.end();
    default:
      return true;
  }
}

bool Policy::Subject::covers(const Subject& other) const {
  return kind == Kind::kEveryone || *this == other;
}

bool Policy::Rule::covers(const Rule& later) const {
  if (!who.covers(later.who) || (later.actions & ~actions) != 0) return false;
  return (later.actions & kOnPorts) == 0 || glob_covers(glob, later.glob);
}

Policy::Verdict Policy::may(const Identity& who, Action action, std::string_view port) const {
  for (const Rule& rule : rules_) {
    if ((rule.actions & bit(action)) == 0 || !rule.who.includes(who)) continue;
    if (is_about_a_port(action) && !rules::matches(rule.glob, port)) continue;
    if (path_.empty()) return {rule.allows, "the default policy says: " + rule.text};
    return {rule.allows, path_ + ":" + std::to_string(rule.line) + " says: " + rule.text};
  }
  if (who.user == 0) return {true, "root may, where no line says otherwise"};
  if (who.user == owner_) return {true, "the daemon's own user may, where no line says otherwise"};
  if (path_.empty()) {
    return {false,
            "the default policy allows it to root and to the daemon's own user alone; "
            "arbiterd --policy takes another one"};
  }
  return {false, "no line of " + path_ + " allows it", true};
}

bool Policy::has_rules_of(const Policy& other) const {
  return owner_ == other.owner_ &&
         std::equal(rules_.begin(), rules_.end(), other.rules_.begin(), other.rules_.end(),
                    [](const Rule& one, const Rule& another) { return one.decides_as(another); });
}

std::vector<Policy::Pattern> Policy::patterns() const {
  std::vector<Pattern> patterns;
  for (const Rule& rule : rules_) {
    if (!rule.where) continue;
    patterns.push_back({rule.glob, (rule.actions & kOnOutputs) != 0,
                        (rule.actions & kOnInputs) != 0, &*rule.where});
  }
  return patterns;
}

}  // namespace arbiter::service
