#include "rules/model/evaluation.hpp"

#include <stdexcept>

namespace arbiter::rules {
namespace {

Truth equal(Truth left, Truth right) {
  if (left == Truth::kUnknown || right == Truth::kUnknown) return Truth::kUnknown;
  return truth(left == right);
}

}  // namespace

// They are no deeper than kMaxConditionDepth, or than a diagram, hence recursion is fine.
Truth Evaluation::of(const Expression& expression) {
  if (expression.op == Operator::kSource) return look_(expression.name);
  if (const auto known = known_.find(&expression); known != known_.end()) return known->second;
  const Truth result = evaluate_new(expression);
  known_.emplace(&expression, result);
  return result;
}

Truth Evaluation::evaluate_new(const Expression& expression) {
  const auto operand = [&](std::size_t i) { return of(*expression.operands[i]); };
  switch (expression.op) {
    case Operator::kFalse:
      return Truth::kFalse;
    case Operator::kTrue:
      return Truth::kTrue;
    case Operator::kNot:
      return negate(operand(0));
    case Operator::kAnd:
      return join(expression, Truth::kFalse);
    case Operator::kOr:
      return join(expression, Truth::kTrue);
    case Operator::kXor:
      return negate(equal(operand(0), operand(1)));
    case Operator::kIff:
      return equal(operand(0), operand(1));
    case Operator::kImplies: {
      const Truth left = operand(0);
      if (left == Truth::kFalse) return Truth::kTrue;
      const Truth right = operand(1);
      return left == Truth::kTrue || right == Truth::kTrue ? right : Truth::kUnknown;
    }
    default:
      throw std::logic_error("a quantifier in an expression that should have been expanded");
  }
}

Truth Evaluation::join(const Expression& expression, Truth decisive) {
  Truth result = negate(decisive);
  for (const auto& operand : expression.operands) {
    const Truth value = of(*operand);
    if (value == decisive) return decisive;
    if (value == Truth::kUnknown) result = value;
  }
  return result;
}

bool evaluate(const Expression& expression, const IsActive& is_active) {
  Evaluation evaluation([&](const std::string& source) { return truth(is_active(source)); });
  return evaluation.of(expression) == Truth::kTrue;
}

}  // namespace arbiter::rules
