// From expressions to decision diagrams.
#pragma once

#include <set>
#include <string>
#include <unordered_map>
#include <vector>

#include "rules/model/expression.hpp"
#include "rules/model/rule_set.hpp"
#include "rules/prove/compiled_model.hpp"
#include "rules/prove/diagram.hpp"

namespace arbiter::rules {

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
  void forget_parts() {
    built_.clear();
    first_levels_.clear();
  }

 private:
  int first_level(const Expression& expression);
  Diagram build(const ExpressionPtr& expression);
  Diagram build_new(const Expression& expression);
  Diagram join(Operator op, const std::vector<const ExpressionPtr*>& operands);
  Diagram join(Operator op, const Expression& literal, const Diagram& rest);

  DiagramBuilder& builder_;
  bool joins_as_written_ = false;
  std::vector<std::string> names_;
  std::unordered_map<std::string, int> variables_;
  std::unordered_map<const Expression*, Diagram> built_;  // shared ones are built once
  // Of what is no source. Sifting may make them out of date, which costs steps and nothing else.
  std::unordered_map<const Expression*, int> first_levels_;
};

// The kind, reads and nodes of a rule whose function is given, its own source taken as active.
CompiledRule to_compiled_rule(std::string source, const DiagramNodes& function,
                              const std::vector<std::string>& names);

}  // namespace arbiter::rules
