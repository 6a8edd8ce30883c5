// Why a behaviour can never run: what contradicts what, in words.
#pragma once

#include <string>

#include "rules/model/rule_set.hpp"
#include "rules/prove/diagram.hpp"

namespace arbiter::rules {

// Of each connection of the behaviour, which demands together nothing satisfies, with none of them
// left out that is not needed: ": at /p, /a would need /b ∧ ¬/b". For the first few connections;
// empty where a bound is met. For a behaviour that can never run.
std::string why_it_never_runs(DiagramBuilder& builder, const BehaviourRules& behaviour,
                              const RuleSet& rules);

}  // namespace arbiter::rules
