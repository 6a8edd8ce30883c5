// Whether one statement is true in every state, by the diagrams of the ports that it speaks of.
#pragma once

#include <map>
#include <optional>
#include <set>
#include <string>
#include <unordered_map>
#include <vector>

#include "rules/budget.hpp"
#include "rules/compile.hpp"
#include "rules/expression.hpp"
#include "rules/winners.hpp"

namespace arbiter::rules {

// The diagrams of some ports, which all statements about these ports share: who wins is worked out
// once, however many ask. What a bound interrupts is gone on with when it is asked for again.
class Scene {
 public:
  Scene(Budget& budget, const SourceOrder& order) : winners_(budget, order) {}

  Winners& winners() { return winners_; }
  // All of these throw as DiagramBuilder's. After a DiagramLimit that is no StepLimit, the scene is
  // lost.
  Diagram winner(const CompiledRule& rule);
  Diagram idle(const CompiledPort& port);

 private:
  struct Idle {
    Diagram states;  // in which none of the rules so far wins
    std::size_t rules = 0;
  };

  Winners winners_;  // outlives the diagrams below
  std::unordered_map<const CompiledRule*, Diagram> winner_;
  std::map<const CompiledPort*, Idle> idle_;
};

// What `=N` in an expression stands for: that this connection wins.
struct Term {
  const CompiledPort* port;
  const CompiledRule* rule;  // null: nobody wins
};

class Question {
 public:
  enum class Way {
    kAtOnce,
    // That nobody wins is the only function that needs all rules of a port in one diagram. Where
    // that is too large, each possible winner is looked at by itself.
    kByCases,
  };

  // Refers to all three.
  Question(const Expression& expression, const std::vector<Term>& terms, Scene& scene);

  [[nodiscard]] bool has_cases() const { return !idle_.empty(); }
  // A witness against the statement, if there is one. Throws as DiagramBuilder's operations.
  std::optional<Witness> refute(Way way);

 private:
  Diagram refute_by_cases(std::size_t next, const Diagram& state);
  Diagram build(const Expression& expression);
  Diagram build_new(const Expression& expression);
  Diagram build_term(const Term& term);

  const Expression& expression_;
  const std::vector<Term>& terms_;
  Scene& scene_;
  Winners& winners_;
  std::vector<const CompiledPort*> idle_;  // of which the statement says that nobody wins
  std::unordered_map<const Expression*, Diagram> built_;
  std::map<const CompiledPort*, const CompiledRule*> decided_;  // null: nobody wins
};

}  // namespace arbiter::rules
