// Who is active at some moment, and what follows from it.
#pragma once

#include <map>
#include <set>
#include <string>

#include "rules/model/rule_set.hpp"

namespace arbiter::drawing {

struct Situation {
  std::set<std::string> active;                // sources
  std::map<std::string, std::string> winners;  // by arbitrated port; none where it is idle
  std::map<std::string, std::string> hosts;    // by source: another host, from which it comes
};

// Whether the rule holds: its source is active, and its condition true.
bool holds(const rules::ConnectionRule& rule, const std::set<std::string>& active);

Situation decide(const rules::RuleSet& rules, std::set<std::string> active);

enum class State { kSilent, kOverridden, kRuns };

// A behaviour runs if a connection wins by its rule, and is overridden if it merely is active.
State state_of(const rules::BehaviourRules& behaviour, const Situation& situation);

}  // namespace arbiter::drawing
