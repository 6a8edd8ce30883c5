// Whether one statement is true in every state, by the diagrams of the ports that it speaks of.
#pragma once

#include <map>
#include <optional>
#include <set>
#include <string>
#include <unordered_map>
#include <vector>

#include "rules/model/expression.hpp"
#include "rules/prove/budget.hpp"
#include "rules/prove/compile.hpp"
#include "rules/prove/winners.hpp"

namespace arbiter::rules {

// The diagrams of some ports, which all statements about these ports share: who wins is worked out
// once, however many ask. What a bound interrupts is gone on with when it is asked for again.
class Scene {
 public:
  // Its diagrams must not outlive the winners.
  explicit Scene(Winners& winners) : winners_(winners) {}

  Winners& winners() { return winners_; }
  // As Winners'. All of these throw as DiagramBuilder's; after a DiagramLimit that is no StepLimit,
  // the scene is lost.
  Diagram winner(const CompiledPort& port, const CompiledRule& rule);
  Diagram holds(const CompiledRule& rule);
  // The states in which nobody wins there.
  Diagram idle(const CompiledPort& port);

 private:
  struct Idle {
    Diagram states;  // in which none of the rules so far holds
    std::size_t rules = 0;
  };

  Winners& winners_;
  std::unordered_map<const CompiledRule*, Diagram> winner_, holds_;
  std::map<const CompiledPort*, Idle> idle_;
};

// What `=N` in an expression stands for.
struct Term {
  const CompiledPort* port;
  std::vector<const CompiledRule*> rules{};  // of which one wins
  bool nobody = false;                       // in place of these: nobody wins
  const CompiledPort* other = nullptr;       // in place of both: the winner is the same there

  // That takes all rules of a port in one diagram.
  [[nodiscard]] bool is_of_all() const { return nobody || other != nullptr; }
};

class Question {
 public:
  enum class Way {
    kAtOnce,
    // That nobody wins, or the same as elsewhere, needs all rules of a port in one diagram. Where
    // that is too large, each possible winner is looked at by itself.
    kByCases,
  };

  // Refers to all three.
  Question(const Expression& expression, const std::vector<Term>& terms, Scene& scene);

  [[nodiscard]] bool has_cases() const { return !whole_.empty(); }
  // A witness against the statement, if there is one. Throws as DiagramBuilder's operations.
  std::optional<Witness> refute(Way way);
  // The states in which the statement is true if that rule's source wins at the port.
  Diagram if_it_won(const CompiledPort& port, const CompiledRule& rule);

 private:
  void add_whole(const CompiledPort& port);
  Diagram refute_by_cases(std::size_t next, const Diagram& state);
  Diagram build(const Expression& expression);
  Diagram build_new(const Expression& expression);
  Diagram build_term(const Term& term);
  Diagram build_same(const CompiledPort& port, const CompiledPort& other);
  Diagram wins_at(const CompiledPort& port, const std::string& source);

  const Expression& expression_;
  const std::vector<Term>& terms_;
  Scene& scene_;
  Winners& winners_;
  std::vector<const CompiledPort*> whole_;  // of which it takes all rules to tell
  std::unordered_map<const Expression*, Diagram> built_;
  std::map<const CompiledPort*, const CompiledRule*> decided_;  // null: nobody wins
};

}  // namespace arbiter::rules
