#include "rules/explain/assume.hpp"

#include <optional>
#include <unordered_map>
#include <utility>
#include <vector>

namespace arbiter::rules {
namespace {

std::optional<bool> constant_of(const Expression& expression) {
  if (expression.op == Operator::kTrue) return true;
  if (expression.op == Operator::kFalse) return false;
  return std::nullopt;
}

ExpressionPtr negation(ExpressionPtr operand) {
  if (const auto value = constant_of(*operand)) return make_constant(!*value);
  return make_operation(Operator::kNot, {std::move(operand)});
}

// Of kAnd and kOr: an operand that is `decisive` decides, one that is the opposite says nothing.
ExpressionPtr join(Operator op, std::vector<ExpressionPtr> operands) {
  const bool decisive = op == Operator::kOr;
  std::vector<ExpressionPtr> rest;
  for (ExpressionPtr& operand : operands) {
    const auto value = constant_of(*operand);
    if (value == decisive) return make_constant(decisive);
    if (!value) rest.push_back(std::move(operand));
  }
  if (rest.empty()) return make_constant(!decisive);
  return rest.size() == 1 ? rest.front() : make_operation(op, std::move(rest));
}

ExpressionPtr imply(ExpressionPtr left, ExpressionPtr right) {
  if (const auto value = constant_of(*left)) return *value ? right : make_constant(true);
  if (const auto value = constant_of(*right)) return *value ? right : negation(std::move(left));
  return make_operation(Operator::kImplies, {std::move(left), std::move(right)});
}

ExpressionPtr compare(Operator op, ExpressionPtr left, ExpressionPtr right) {
  if (constant_of(*right)) std::swap(left, right);
  const auto value = constant_of(*left);
  if (!value) return make_operation(op, {std::move(left), std::move(right)});
  const bool is_same = *value == (op == Operator::kIff);
  return is_same ? right : negation(std::move(right));
}

// Expressions share parts; each is gone through once. They are no deeper than kMaxConditionDepth,
// or than a diagram, hence recursion is fine.
class Assumption {
 public:
  explicit Assumption(const std::string& source) : source_(source) {}

  ExpressionPtr of(const ExpressionPtr& expression) {
    if (expression->op == Operator::kSource) {
      return expression->name == source_ ? always_ : expression;
    }
    if (expression->operands.empty()) return expression;
    const auto known = known_.find(expression.get());
    if (known != known_.end()) return known->second;
    std::vector<ExpressionPtr> operands;
    bool differs = false;
    for (const ExpressionPtr& operand : expression->operands) {
      operands.push_back(of(operand));
      differs = differs || operands.back() != operand;
    }
    ExpressionPtr result = differs ? remake(expression->op, std::move(operands)) : expression;
    return known_.emplace(expression.get(), std::move(result)).first->second;
  }

 private:
  static ExpressionPtr remake(Operator op, std::vector<ExpressionPtr> operands) {
    switch (op) {
      case Operator::kNot:
        return negation(std::move(operands[0]));
      case Operator::kAnd:
      case Operator::kOr:
        return join(op, std::move(operands));
      case Operator::kImplies:
        return imply(std::move(operands[0]), std::move(operands[1]));
      default:
        return compare(op, std::move(operands[0]), std::move(operands[1]));
    }
  }

  const std::string& source_;
  const ExpressionPtr always_ = make_constant(true);
  std::unordered_map<const Expression*, ExpressionPtr> known_;
};

}  // namespace

ExpressionPtr assume_active(const ExpressionPtr& expression, const std::string& source) {
  return Assumption(source).of(expression);
}

}  // namespace arbiter::rules
