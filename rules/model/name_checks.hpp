// Names that nobody has: what a model says of sources and ports that there are probably not.
#pragma once

#include <optional>

#include "rules/model/document_order.hpp"
#include "rules/model/model.hpp"
#include "rules/model/rule_set.hpp"
#include "rules/text/diagnostic.hpp"

namespace arbiter::rules {

// Warnings "similar-name", of names that stand in one place and are a slip away from another one,
// and "wrong-end", of sources that are input ports, and the other way round. To be asked only where
// no name is missing: what was refused may have had it (may_lack_names). Where the model has no
// error, `rules` are its rules, and not null: then also "never-read", of sources that are declared
// and that no rule reads or selects. `whole` is the place for what cannot be pinned to a line.
void check_names(const Model& model, const std::optional<Application>& application,
                 const RuleSet* rules, const Location& whole, const DocumentOrder& order,
                 Diagnostics& diagnostics);

}  // namespace arbiter::rules
