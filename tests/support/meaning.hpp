// What a condition means, by the book: slow, and nothing of it shared with what is tested.
#pragma once

#include <algorithm>
#include <set>
#include <stdexcept>
#include <string>

#include "rules/model/expression.hpp"

namespace arbiter::test {

using Active = std::set<std::string>;

// Of an expression without quantifiers.
inline bool holds(const rules::Expression& expression, const Active& active) {
  using rules::Operator;
  const auto& operands = expression.operands;
  const auto operand = [&](std::size_t i) { return holds(*operands.at(i), active); };
  const auto each = [&](const rules::ExpressionPtr& part) { return holds(*part, active); };
  switch (expression.op) {
    case Operator::kFalse:
      return false;
    case Operator::kTrue:
      return true;
    case Operator::kSource:
      return active.contains(expression.name);
    case Operator::kNot:
      return !operand(0);
    case Operator::kAnd:
      return std::all_of(operands.begin(), operands.end(), each);
    case Operator::kOr:
      return std::any_of(operands.begin(), operands.end(), each);
    case Operator::kXor:
      return operand(0) != operand(1);
    case Operator::kImplies:
      return !operand(0) || operand(1);
    case Operator::kIff:
      return operand(0) == operand(1);
    default:
      throw std::logic_error("a quantifier");
  }
}

}  // namespace arbiter::test
