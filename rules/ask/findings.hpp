// What is worth knowing of a model that is correct: found over all states of the sources, after
// compile(), and by a check only. Codes and what to do about them: docs/checking.md.
#pragma once

#include <cstddef>

#include "rules/ask/verdict.hpp"
#include "rules/model/rule_set.hpp"
#include "rules/prove/budget.hpp"
#include "rules/prove/compile.hpp"
#include "rules/text/diagnostic.hpp"

namespace arbiter::rules {

struct FindingsAccount {
  std::size_t ports = 0;  // arbitrated ones
  std::size_t open = 0;   // of which a question was left open, with a note that says so
};

// Warnings "never-wins" and "inhibition-circle"; notes "nobody-wins", "starved" and "left-open".
// States of which proved statements say that nobody wins are known, and not noted: those in which
// they leave it to nobody. Shares out what is left of the budget among the ports. Throws Stopped.
FindingsAccount find_more(const RuleSet& rules, const CompiledModel& model,
                          Diagnostics& diagnostics, Budget& budget,
                          const ProvedStatements& statements = {});

}  // namespace arbiter::rules
