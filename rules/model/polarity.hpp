// Which sources a condition asks to be active, and which to be inactive, by the way it is written.
#pragma once

#include <set>
#include <string>
#include <utility>

#include "rules/model/expression.hpp"

namespace arbiter::rules {

// A source may be both: in "xor" and "iff" it is. What is not written is in neither set; what is
// written and makes no difference ("/a or not /a") is in them all the same.
class Polarity {
 public:
  // `positive`: what surrounds the expression is not negated.
  void visit(const Expression& expression, bool positive = true);
  void add(const std::string& source, bool positive) {
    (positive ? required_ : negated_).insert(source);
  }

  // Being active can help to make the expression true.
  [[nodiscard]] const std::set<std::string>& required() const { return required_; }
  // Being inactive can.
  [[nodiscard]] const std::set<std::string>& negated() const { return negated_; }

 private:
  // Expressions share much: what was seen already is not looked at again.
  std::set<std::pair<const Expression*, bool>> seen_;
  std::set<std::string> required_;
  std::set<std::string> negated_;
};

inline void Polarity::visit(const Expression& expression, bool positive) {
  if (!seen_.insert({&expression, positive}).second) return;
  const auto& operands = expression.operands;
  switch (expression.op) {
    case Operator::kSource:
      add(expression.name, positive);
      return;
    case Operator::kNot:
      visit(*operands[0], !positive);
      return;
    case Operator::kImplies:
      visit(*operands[0], !positive);
      visit(*operands[1], positive);
      return;
    case Operator::kXor:
    case Operator::kIff:
      for (const auto& operand : operands) {
        visit(*operand, positive);
        visit(*operand, !positive);
      }
      return;
    default:
      for (const auto& operand : operands) visit(*operand, positive);
  }
}

}  // namespace arbiter::rules
