#include "drawing/situation.hpp"

#include <utility>

#include "rules/model/evaluation.hpp"

namespace arbiter::drawing {

bool holds(const rules::ConnectionRule& rule, const std::set<std::string>& active) {
  const auto is_active = [&](const std::string& source) { return active.contains(source); };
  return is_active(rule.source) && rules::evaluate(*rule.condition, is_active);
}

Situation decide(const rules::RuleSet& rules, std::set<std::string> active) {
  Situation situation{std::move(active), {}, {}};
  for (const rules::PortRules& port : rules.ports) {
    for (const rules::ConnectionRule& rule : port.rules) {
      // Where more than one may hold, the first one wins.
      if (holds(rule, situation.active)) situation.winners.emplace(port.port, rule.source);
    }
  }
  return situation;
}

State state_of(const rules::BehaviourRules& behaviour, const Situation& situation) {
  State state = State::kSilent;
  for (const auto& [port, rule] : behaviour.rules) {
    if (!situation.active.contains(rule.source)) continue;
    const auto winner = situation.winners.find(port);
    const bool wins = winner != situation.winners.end() && winner->second == rule.source;
    if (wins && holds(rule, situation.active)) return State::kRuns;
    state = State::kOverridden;
  }
  return state;
}

}  // namespace arbiter::drawing
