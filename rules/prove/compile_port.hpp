// Compiles and proves the rules of one port.
#pragma once

#include <optional>
#include <set>
#include <string>
#include <unordered_map>
#include <vector>

#include "rules/prove/compile.hpp"
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
  CompileContext(Budget& of_all, Diagnostics& to, std::size_t most)
      : budget(of_all), diagnostics(to), max_precedence_nodes(most) {}

  Budget& budget;
  DiagramBuilder builder{budget};
  Proof proof{budget};
  Diagnostics& diagnostics;
  const std::size_t max_precedence_nodes;
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

// Of an operator with two operands or more.
Connective connective_of(Operator op);

// Turns expressions into diagrams.
class RuleBuilder {
 public:
  explicit RuleBuilder(DiagramBuilder& builder) : builder_(builder) {}

  // Numbers a source, so that the order of the variables is that of their first mention.
  void mention(const std::string& source);
  void mention_all(const Expression& expression, std::set<std::string>& written);

  [[nodiscard]] int variable(const std::string& source) const { return variables_.at(source); }
  [[nodiscard]] const std::vector<std::string>& names() const { return names_; }  // by variable

  // Operands are joined from the last variable to the first, which is nearly always best; or, from
  // now on, as they are written: what follows may be what keeps the rest small.
  void join_as_written() { joins_as_written_ = true; }

  // The own source active, and the condition.
  Diagram rule(const ConnectionRule& rule);
  void forget_parts() { built_.clear(); }

 private:
  [[nodiscard]] int first_level(const Expression& expression) const;
  Diagram build(const ExpressionPtr& expression);
  Diagram build_new(const Expression& expression);
  Diagram join(Operator op, const std::vector<const ExpressionPtr*>& operands);
  Diagram join(Operator op, const Expression& literal, const Diagram& rest);

  DiagramBuilder& builder_;
  bool joins_as_written_ = false;
  std::vector<std::string> names_;
  std::unordered_map<std::string, int> variables_;
  std::unordered_map<const Expression*, Diagram> built_;  // shared ones are built once
};

// The kind, reads and nodes of a rule whose function is given, its own source taken as active.
CompiledRule to_compiled_rule(std::string source, const DiagramNodes& function,
                              const std::vector<std::string>& names);

}  // namespace arbiter::rules
