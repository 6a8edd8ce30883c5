// From behaviours to the rules of the arbiters (paper, section V).
#pragma once

#include <cstddef>

#include "rules/model/hierarchy.hpp"
#include "rules/model/model.hpp"
#include "rules/model/rule_set.hpp"
#include "rules/text/diagnostic.hpp"

namespace arbiter::rules {

// Of all rules together, counted before what is the same is joined: what a model may ask of us. A
// condition has one for each name and operator in it, and counts in each rule that it is part of.
inline constexpr std::size_t kMaxRuleTerms = 16u << 20;

// Sources, timeouts, ports with their rules, behaviours; other_connections stay empty. Notes and
// warnings are left out where errors were found before, since they might only follow from these.
RuleSet extract_rules(const Model& model, const Hierarchy& hierarchy, Diagnostics& diagnostics);

}  // namespace arbiter::rules
