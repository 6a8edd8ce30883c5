// What a model means when its ports are on several hosts: what crosses the network, what a cut does
// to it, and what is no longer decided at one instant. Codes: docs/checking.md, "Several hosts".
#pragma once

#include <string>
#include <vector>

#include "rules/ask/host_places.hpp"
#include "rules/ask/verdict.hpp"
#include "rules/model/rule_set.hpp"
#include "rules/prove/budget.hpp"
#include "rules/prove/compile.hpp"
#include "rules/text/diagnostic.hpp"

namespace arbiter::rules {

// Errors "remote-forever"; warnings "negated-across-hosts" and "statement-on-two-hosts"; notes
// "crosses-network", "behaviour-on-two-hosts", "not-at-one-instant" and "left-open". Of a model
// without errors. Takes no more than is left of the budget. Throws Stopped.
void find_across_hosts(const RuleSet& rules, const CompiledModel& model, const SourceUses& uses,
                       const HostPlaces& places, const std::vector<Verdict>& verdicts,
                       Diagnostics& diagnostics, Budget& budget);

}  // namespace arbiter::rules
