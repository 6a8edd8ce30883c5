// Who wins at a port in which states of the sources, as decision diagrams: what the questions asked
// of compiled models are answered with.
//
// A state says of each source whether it is active. With the rules of a port compiled and proved,
// at most one of winner(port, rule) holds in any state. There is no diagram of a whole port, which
// would explode where connections are inhibited by a few others each (rules/prove/proof.hpp).
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <set>
#include <string>
#include <unordered_map>
#include <vector>

#include "rules/prove/compiled_model.hpp"
#include "rules/prove/diagram.hpp"

namespace arbiter::rules {

// The sources that ports read or are connected to, as variables, in an order that keeps the
// diagrams of all of them as small as it can: that of the first port, with what others add.
class SourceOrder {
 public:
  void add(const CompiledPort& port);
  void add(const std::string& source);

  [[nodiscard]] const std::vector<std::string>& names() const { return names_; }

 private:
  std::vector<std::string> names_;
};

class Winners {
 public:
  // Throws DiagramLimit if there are more sources than DiagramBuilder::kMaxVariables.
  Winners(Budget& budget, const SourceOrder& order, bool sifts = true);

  [[nodiscard]] const std::vector<std::string>& sources() const { return names_; }

  // All of these throw as DiagramBuilder's.
  Diagram combine(Connective connective, const Diagram& a, const Diagram& b) {
    return builder_.combine(connective, a, b);
  }
  Diagram negate(const Diagram& a) { return combine(Connective::kXor, a, constant(true)); }
  Diagram constant(bool value) { return builder_.constant(value); }
  Diagram active(const std::string& source) { return builder_.variable(variables_.at(source)); }
  // The states in which the rule's source is active, and wins at the port.
  Diagram winner(const CompiledPort& port, const CompiledRule& rule);
  // The same, but for the rules before it where those of a port are decided in order. So some
  // connection of a port wins iff holds() of one of them does.
  Diagram holds(const CompiledRule& rule);
  // The function in the states that differ from each one only in that the source is (not) active.
  Diagram given(const Diagram& function, const std::string& source, bool active);
  // Whether in some state the function is true, and would not be if only the source were not
  // (in)active.
  bool needs(const Diagram& function, const std::string& source, bool active) {
    return builder_.needs(function, variables_.at(source), active);
  }

  // A shortest conjunction that implies the function, which can be true; or, where the search for
  // it takes too long, one of which no literal can be left out. That one may be found beyond the
  // budget.
  Witness witness(const Diagram& function) { return witness(function, constant(true)); }
  // The same among the conjunctions that hold in some state of `reached`, in one of which the
  // function is true.
  Witness witness(const Diagram& function, const Diagram& reached);

  DiagramNodes nodes(const Diagram& function) { return builder_.nodes(function); }

 private:
  std::vector<std::string> names_;
  std::unordered_map<std::string, int> variables_;
  Budget& budget_;
  DiagramBuilder builder_;
};

// The rule that selects its connection in that state; null if nobody wins.
const CompiledRule* find_winner(const CompiledPort& port, const std::set<std::string>& active);

}  // namespace arbiter::rules
