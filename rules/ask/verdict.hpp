// Whether a statement is true of a compiled model in every state of its sources.
//
// A state says of each source whether it is active. The winner at an arbitrated port is the one
// that the port's rules select in that state, with conflict="first" if the port has it. Quantifiers
// range over all sources that the model or its application names.
//
// Thread safety: as rules/ask/model_diff.hpp.
#pragma once

#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "rules/model/statement.hpp"
#include "rules/prove/budget.hpp"
#include "rules/prove/compile.hpp"
#include "rules/prove/winners.hpp"
#include "rules/text/diagnostic.hpp"

namespace arbiter::rules {

// A statement that was proved, looked up in the model that it was proved of; to be used while that
// lives.
struct ProvedStatement;
using ProvedStatements = std::vector<std::shared_ptr<const ProvedStatement>>;

struct Verdict {
  enum class Kind { kProved, kRefuted, kOpen };

  Kind kind = Kind::kProved;
  std::string statement;
  Location where;
  std::vector<std::string> ports;  // that it mentions
  // Where refuted: a conjunction under which the statement is false, whatever the other
  // sources do; and who wins at each port of the statement if they are inactive.
  std::optional<Witness> witness;
  std::vector<std::pair<std::string, std::optional<std::string>>> winners;
  std::string limit;  // where open: what was exceeded
  std::shared_ptr<const ProvedStatement> proved;
};

// Verdicts on all statements that have a meaning in the model, in their order. Ports and sources
// that it does not know, ports that are not arbitrated, and winners that are not connected are
// reported as errors; patterns that nothing matches as warnings. Shares out what is left of the
// budget among the statements. Throws Stopped.
std::vector<Verdict> judge(const std::vector<Statement>& statements, const CompiledModel& model,
                           Diagnostics& diagnostics, Budget& budget);

[[nodiscard]] bool speaks_of(const ProvedStatement& statement, const CompiledPort& port);
// What it takes to ask the next question of each of them.
void add_sources(const ProvedStatements& statements, SourceOrder& order);
// Of the states, those in which the statement allows that this rule's source wins at the port, with
// all other ports as they are. Throws DiagramLimit.
[[nodiscard]] Diagram allowed_by(const ProvedStatement& statement, Winners& winners,
                                 const CompiledPort& port, const CompiledRule& rule,
                                 const Diagram& states);

// An error for each statement that is refuted or left open; if asked for, a note "proved" for each
// that is true.
void report(const std::vector<Verdict>& verdicts, Diagnostics& diagnostics,
            bool with_proved = false);

}  // namespace arbiter::rules
