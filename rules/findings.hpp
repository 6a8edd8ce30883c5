// What is worth knowing of a model that is correct: found over all states of the sources, after
// compile(), and by a check only. Codes and what to do about them: docs/checking.md.
#pragma once

#include <cstddef>
#include <cstdint>

#include "rules/compile.hpp"
#include "rules/diagnostic.hpp"
#include "rules/rule_set.hpp"
#include "rules/verdict.hpp"

namespace arbiter::rules {

// What was asked, and what of it was answered. Time depends on the machine; this does not.
struct FindingsAccount {
  std::size_t ports = 0;   // arbitrated ones
  std::size_t open = 0;    // of which a question was left open, with a note that says so
  std::uint64_t work = 0;  // nodes of all diagrams
};

// Nodes of the diagrams of all ports together: some seconds.
inline constexpr std::uint64_t kMaxFindingsWork = 40'000'000;
// And of those of one port, so that one cannot use up all.
inline constexpr std::uint64_t kMaxPortWork = 4'000'000;

// Warnings "never-wins"; notes "nobody-wins", "starved" and "left-open". States of which proved
// statements say that nobody wins are known, and not noted: those in which they leave it to nobody.
FindingsAccount find_more(const RuleSet& rules, const CompiledModel& model,
                          Diagnostics& diagnostics, std::uint64_t max_work = kMaxFindingsWork,
                          const ProvedStatements& statements = {});

}  // namespace arbiter::rules
