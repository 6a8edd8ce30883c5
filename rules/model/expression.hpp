// Boolean expressions over the activity of sources: conditions, and the rules made of them.
#pragma once

#include <cstdint>
#include <memory>
#include <set>
#include <string>
#include <utility>
#include <vector>

namespace arbiter::rules {

enum class Operator : std::uint8_t {
  kFalse,
  kTrue,
  kSource,  // name: is this source active?
  kNot,     // one operand
  kAnd,     // any number of operands, as kOr; none: true
  kOr,      // none: false
  kXor,     // two operands, as the following
  kImplies,
  kIff,
  kAny,  // name: a glob over the sources that the model names; gone once it is expanded
  kAll,
  kNone,
};

struct Expression;
using ExpressionPtr = std::shared_ptr<const Expression>;

// Immutable, so that rules share the conditions that they have in common.
struct Expression {
  Operator op = Operator::kTrue;
  std::string name;
  std::vector<ExpressionPtr> operands;
};

inline ExpressionPtr make_constant(bool value) {
  return std::make_shared<Expression>(
      Expression{value ? Operator::kTrue : Operator::kFalse, {}, {}});
}
inline ExpressionPtr make_source(std::string name) {
  return std::make_shared<Expression>(Expression{Operator::kSource, std::move(name), {}});
}
inline ExpressionPtr make_operation(Operator op, std::vector<ExpressionPtr> operands) {
  return std::make_shared<Expression>(Expression{op, {}, std::move(operands)});
}
inline ExpressionPtr make_quantifier(Operator op, std::string glob) {
  return std::make_shared<Expression>(Expression{op, std::move(glob), {}});
}

// Expressions share much: what was seen already is not looked at again. `sources` are a set of
// names, or of views of those in the expression; `seen` of pointers to expressions.
template <typename Sources, typename Seen>
void add_sources_of(const Expression& expression, Sources& sources, Seen& seen) {
  if (!seen.insert(&expression).second) return;
  if (expression.op == Operator::kSource) sources.insert(expression.name);
  for (const ExpressionPtr& operand : expression.operands) add_sources_of(*operand, sources, seen);
}

}  // namespace arbiter::rules
