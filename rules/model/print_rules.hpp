// Writes extracted rules as the paper does (sections III.A and V).
#pragma once

#include <ostream>
#include <string>

#include "rules/model/expression.hpp"
#include "rules/model/rule_set.hpp"

namespace arbiter::rules {

// In the language of conditions, with as few parentheses as its precedences allow.
std::string to_string(const Expression& expression);

// "/Face/pos:o ∧ ¬/Object/pos:o": the whole rule, the connection's own activity first.
std::string to_string(const ConnectionRule& rule);

// By port:
//   /Gaze/pos:i
//     /Face/pos:o ∧ ¬/Object/pos:o ⇒ Select(/Face/pos:o)
void write_rules(std::ostream& out, const RuleSet& rules);

// {timeout, timeouts: {source: timeout}, ports: [{port, arbitrated, conflict, connections:
// [{source, rule, behaviours}]}]}; the rule is null where no rule selects the connection.
void write_rules_json(std::ostream& out, const RuleSet& rules);

}  // namespace arbiter::rules
