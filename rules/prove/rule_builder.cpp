#include "rules/prove/rule_builder.hpp"

#include <algorithm>
#include <limits>
#include <stdexcept>
#include <unordered_set>

namespace arbiter::rules {
namespace {

bool is_literal(const Expression& expression) {
  return expression.op == Operator::kSource ||
         (expression.op == Operator::kNot && expression.operands[0]->op == Operator::kSource);
}

const std::string& source_of(const Expression& literal) {
  return literal.op == Operator::kSource ? literal.name : literal.operands[0]->name;
}

void flatten_operands(const ExpressionPtr& expression, Operator op,
                      std::vector<const ExpressionPtr*>& operands) {
  if (expression->op != op) {
    operands.push_back(&expression);
    return;
  }
  for (const auto& operand : expression->operands) flatten_operands(operand, op, operands);
}

// Each part once, which only what is shared must be remembered for.
void visit_sources(const Expression& expression, std::unordered_set<const Expression*>& seen,
                   const std::function<void(const std::string&)>& visit) {
  if (expression.op == Operator::kSource) visit(expression.name);
  for (const auto& operand : expression.operands) {
    if (operand.use_count() == 1 || seen.insert(operand.get()).second) {
      visit_sources(*operand, seen, visit);
    }
  }
}

}  // namespace

Connective connective_of(Operator op) {
  switch (op) {
    case Operator::kAnd:
      return Connective::kAnd;
    case Operator::kOr:
      return Connective::kOr;
    case Operator::kXor:
      return Connective::kXor;
    case Operator::kImplies:
      return Connective::kImplies;
    case Operator::kIff:
      return Connective::kIff;
    default:
      throw std::logic_error("a quantifier in a rule that should have been expanded");
  }
}

void RuleBuilder::mention(const std::string& source) {
  const bool is_new = variables_.try_emplace(source, static_cast<int>(names_.size())).second;
  if (is_new) names_.push_back(source);
}

void RuleBuilder::mention_all(const Expression& expression, std::set<std::string>& written) {
  std::unordered_set<const Expression*> seen;
  visit_sources(expression, seen, [&](const std::string& source) {
    mention(source);
    written.insert(source);
  });
}

Diagram RuleBuilder::rule(const ConnectionRule& rule) {
  const ExpressionPtr own = make_source(rule.source);
  std::vector<const ExpressionPtr*> operands{&own};
  flatten_operands(rule.condition, Operator::kAnd, operands);
  return join(Operator::kAnd, operands);
}

// Of the sources that the expression names; behind all levels if it names none.
int RuleBuilder::first_level(const Expression& expression) {
  if (expression.op == Operator::kSource) return builder_.level_of(variable(expression.name));
  const auto known = first_levels_.find(&expression);
  if (known != first_levels_.end()) return known->second;
  int first = std::numeric_limits<int>::max();
  for (const auto& operand : expression.operands) first = std::min(first, first_level(*operand));
  first_levels_.emplace(&expression, first);
  return first;
}

Diagram RuleBuilder::build(const ExpressionPtr& expression) {
  if (expression->op == Operator::kSource) return builder_.variable(variable(expression->name));
  if (expression.use_count() == 1) return build_new(*expression);
  if (const auto known = built_.find(expression.get()); known != built_.end()) return known->second;
  Diagram result = build_new(*expression);
  built_.emplace(expression.get(), result);
  return result;
}

Diagram RuleBuilder::build_new(const Expression& expression) {
  const auto& operands = expression.operands;
  switch (expression.op) {
    case Operator::kFalse:
    case Operator::kTrue:
      return builder_.constant(expression.op == Operator::kTrue);
    case Operator::kNot:
      return builder_.negate(build(operands[0]));
    case Operator::kAnd:
    case Operator::kOr: {
      std::vector<const ExpressionPtr*> flat;
      for (const auto& operand : operands) flatten_operands(operand, expression.op, flat);
      return join(expression.op, flat);
    }
    default: {
      const Diagram left = build(operands[0]);
      return builder_.combine(connective_of(expression.op), left, build(operands[1]));
    }
  }
}

// From the operands that begin at the last variable to those that begin at the first. Each of a
// list of literals then only adds a node on top, where the order in which they are written would
// build the whole list anew each time; and of clauses that lie anywhere, what is built so far does
// not reach up to those variables that would multiply it.
Diagram RuleBuilder::join(Operator op, const std::vector<const ExpressionPtr*>& operands) {
  std::vector<std::pair<int, const Expression*>> literals;  // by level
  std::vector<const ExpressionPtr*> others;
  for (const ExpressionPtr* operand : operands) {
    if (is_literal(**operand)) {
      literals.emplace_back(builder_.level_of(variable(source_of(**operand))), operand->get());
    } else {
      others.push_back(operand);
    }
  }
  const auto is_deeper = [](const auto& left, const auto& right) {
    return left.first > right.first;
  };
  std::stable_sort(literals.begin(), literals.end(), is_deeper);
  std::vector<std::pair<int, const ExpressionPtr*>> by_first;
  by_first.reserve(others.size());
  for (const ExpressionPtr* other : others) {
    by_first.emplace_back(joins_as_written_ ? 0 : first_level(**other), other);
  }
  std::stable_sort(by_first.begin(), by_first.end(), is_deeper);
  Diagram result = builder_.constant(op == Operator::kAnd);
  for (const auto& [level, literal] : literals) result = join(op, *literal, result);
  for (const auto& [first, other] : by_first) {
    result = builder_.combine(connective_of(op), result, build(*other));
  }
  return result;
}

Diagram RuleBuilder::join(Operator op, const Expression& literal, const Diagram& rest) {
  const Diagram source = builder_.variable(variable(source_of(literal)));
  if (literal.op == Operator::kSource) return builder_.combine(connective_of(op), source, rest);
  return op == Operator::kAnd ? builder_.combine(Connective::kAndNot, rest, source)
                              : builder_.combine(Connective::kImplies, source, rest);
}

CompiledRule to_compiled_rule(std::string source, const DiagramNodes& function,
                              const std::vector<std::string>& names) {
  using shm::table::kFalse;
  CompiledRule rule;
  rule.source = std::move(source);
  if (function.root >= kFalse) {
    rule.kind = function.root == kFalse ? shm::table::kNever : shm::table::kAlways;
    return rule;
  }
  bool is_conjunction = true;
  int last_level = -1;
  for (const auto& node : function.nodes) {
    if (node.level != last_level)
      rule.reads.push_back(names[static_cast<std::size_t>(node.variable)]);
    last_level = node.level;
    is_conjunction = is_conjunction && (node.low == kFalse || node.high == kFalse);
    const auto position = static_cast<shm::Word>(rule.reads.size() - 1);
    rule.nodes.push_back({position, node.low, node.high});
  }
  rule.kind = is_conjunction ? shm::table::kConjunction : shm::table::kDiagram;
  if (is_conjunction) {
    for (const auto& node : rule.nodes) rule.expected.push_back(node.low == kFalse);
    rule.nodes.clear();
  }
  return rule;
}

}  // namespace arbiter::rules
