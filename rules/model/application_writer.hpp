// The application file with the rules of its arbiters merged in: what the paper's extraction ends
// in (section V, figure 1). What is merged is one element, <arbitration>, a model of rules by hand:
//
//   <application>
//     …
//     <arbitration timeout="500ms">
//       <source port="/collision:o" timeout="1s"/>
//       <arbiter at="/Arm/pos:i">
//         <!-- Rest Arm -->
//         <select from="/RestArm/pos:o">/RestArm/pos:o ∧ ¬/Object/pos:o</select>
//       </arbiter>
//     </arbitration>
//   </application>
//
// YARP's application manager passes over it, as over all that it does not know. Read as a model,
// such a file is model and application in one.
#pragma once

#include <string>
#include <string_view>

#include "rules/model/rule_set.hpp"

namespace arbiter::rules {

// `application` is a well-formed file with that root. It stays as it is, byte by byte, but for an
// <arbitration> that it may have had.
std::string merge_rules(const RuleSet& rules, std::string_view application);

// For a model without an application: one of that name, with the connections that it configures.
std::string write_application(const RuleSet& rules, std::string_view name);

// Whether two rule sets have the same connections, timeouts and rules, these in the same words.
bool same_rules(const RuleSet& a, const RuleSet& b);

}  // namespace arbiter::rules
