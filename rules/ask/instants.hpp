// Connections at ports of two hosts that never win together in one state of the sources. One daemon
// decides both ports by one state; two hosts learn of each change at different times.
#pragma once

#include "rules/ask/host_places.hpp"
#include "rules/model/rule_set.hpp"
#include "rules/prove/budget.hpp"
#include "rules/prove/compiled_model.hpp"
#include "rules/text/diagnostic.hpp"

namespace arbiter::rules {

// The notes "not-at-one-instant" and "left-open". Throws Stopped.
void find_instants(const RuleSet& rules, const CompiledModel& model, const HostPlaces& places,
                   Diagnostics& diagnostics, Budget& budget);

}  // namespace arbiter::rules
