// From rules to decision diagrams, with the proof that at most one connection of a port can win.
#pragma once

#include <cstddef>

#include "rules/model/rule_set.hpp"
#include "rules/prove/budget.hpp"
#include "rules/prove/compiled_model.hpp"
#include "rules/text/diagnostic.hpp"

namespace arbiter::rules {

// How large diagrams with the precedence of conflict="first" in them may get, in nodes, before a
// port's rules are decided in order instead. Larger ones would hardly decide faster, and to make
// them takes seconds.
inline constexpr std::size_t kMaxPrecedenceNodes = 4096;

// Proves every port and reports what fails: two connections that can both win, with a
// witness; rules that nothing satisfies; limits exceeded. To be used only if there is no error.
// Where `diagnostics` has errors already, those of reading `rules`, ports that may depend on them
// are passed over: all that can be judged is, so that all problems are told in one go.
//
// Takes at most four fifths of the budget that is left, and shares them out among the ports. What
// could not be proved within them is an error. The rest is for what is asked of the model
// afterwards: whether it is accepted does not depend on that. Throws Stopped.
CompiledModel compile(const RuleSet& rules, Diagnostics& diagnostics, Budget& budget,
                      std::size_t max_precedence_nodes = kMaxPrecedenceNodes);
// With a budget of its own.
CompiledModel compile(const RuleSet& rules, Diagnostics& diagnostics,
                      std::size_t max_precedence_nodes = kMaxPrecedenceNodes);

}  // namespace arbiter::rules
