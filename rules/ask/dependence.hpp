// Whether who wins at a port depends on a source, by what its rules mean and not by how they are
// written.
#pragma once

#include <optional>
#include <string>

#include "rules/prove/winners.hpp"

namespace arbiter::rules {

class Dependence {
 public:
  // Keeps references. Holds the one instance of diagrams from the first question that takes one.
  Dependence(const CompiledPort& port, Budget& budget) : port_(port), budget_(budget) {}

  // Whether there is a state in which that connection wins, and would not if only `other` were not
  // as it is, namely active or inactive. Also true where nobody can tell within the budget, and
  // where the port's rules are tried in order. Throws Stopped.
  [[nodiscard]] bool needs(const std::string& source, const std::string& other, bool active);

 private:
  bool ask(const CompiledRule& rule, const std::string& other, bool active);

  const CompiledPort& port_;
  Budget& budget_;
  std::optional<Winners> winners_;
  const CompiledRule* of_ = nullptr;  // whose states these are
  Diagram wins_;
};

}  // namespace arbiter::rules
