// Compiles and proves the rules of one port.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "rules/prove/compiled_model.hpp"
#include "rules/prove/conflict_advice.hpp"
#include "rules/prove/diagram.hpp"
#include "rules/prove/proof.hpp"
#include "rules/prove/state_search.hpp"
#include "rules/prove/witness.hpp"

namespace arbiter::rules {

// Steps that a port may take to multiply precedence out, and no more than half of what it has, so
// that there is enough for the rules themselves.
inline constexpr std::uint64_t kMaxPrecedenceSteps = 500'000;

// What the ports of one model share.
struct CompileContext {
  CompileContext(const RuleSet& rules, Budget& of_all, Diagnostics& to, std::size_t most)
      : budget(of_all), diagnostics(to), max_precedence_nodes(most), advice(rules) {}

  Budget& budget;
  DiagramBuilder builder{budget};
  Proof proof{budget};
  Diagnostics& diagnostics;
  const std::size_t max_precedence_nodes;
  ConflictAdvice advice;
};

// A behaviour's part in the rule of one connection of the port.
struct BehaviourPart {
  std::size_t behaviour;  // index into RuleSet::behaviours
  const ConnectionRule* rule;
};

struct PortTask {
  const PortRules& port;
  std::vector<std::string> unselected;  // sources of its connections that no rule selects
  std::vector<BehaviourPart> parts;
};

struct PortResult {
  CompiledPort port;
  std::vector<std::size_t> running;  // behaviours of which some activation satisfies the part
};

// Nothing if a limit was met, which is reported. Throws StepLimit; what it has reported until then
// is of no interest. Throws Stopped.
std::optional<PortResult> compile_port(CompileContext& context, const PortTask& task);

}  // namespace arbiter::rules
