// The states of one port in which somebody wants to win and nobody does.
#pragma once

#include "rules/ask/verdict.hpp"
#include "rules/model/rule_set.hpp"
#include "rules/prove/budget.hpp"
#include "rules/prove/compile.hpp"
#include "rules/text/diagnostic.hpp"

namespace arbiter::rules {

// Warnings "inhibition-circle", notes "nobody-wins" and "starved". `statements`: those that speak
// of the port; states of which they say that nobody wins are not noted. Throws DiagramLimit; what
// has been found until then holds.
void find_where_nobody_wins(const PortRules& rules, const CompiledPort& port,
                            const ProvedStatements& statements, Diagnostics& diagnostics,
                            Budget& budget);

}  // namespace arbiter::rules
