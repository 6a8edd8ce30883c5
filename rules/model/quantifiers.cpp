#include "rules/model/quantifiers.hpp"

#include <algorithm>
#include <set>

#include "rules/text/names.hpp"

namespace arbiter::rules {
namespace {

// As much of a name as there is of the pattern in front of its first '*': to the same '/', or
// within a part as many bytes.
std::string_view same_beginning(std::string_view name, std::string_view before_star) {
  if (!before_star.ends_with('/')) return name.substr(0, before_star.size());
  std::size_t at = 0;
  for (auto left = std::count(before_star.begin(), before_star.end(), '/'); left > 0; --left) {
    at = name.find('/', at);
    if (at == std::string_view::npos) return {};
    ++at;
  }
  return name.substr(0, at);
}

// As many parts of a name as the pattern begins, to the end of the last of them.
std::string_view same_parts(std::string_view name, std::string_view before_star) {
  if (before_star.ends_with('/')) return {};
  const auto parts = std::count(before_star.begin(), before_star.end(), '/');
  std::size_t at = 0;
  for (auto left = parts; left > 0 && at != std::string_view::npos; --left) {
    at = name.find('/', at);
    if (at != std::string_view::npos) ++at;
  }
  if (at == std::string_view::npos) return {};
  return name.substr(0, name.find_first_of("/:", at));
}

}  // namespace

bool matches(std::string_view pattern, std::string_view name) {
  // Only the last '*' ever needs to take more: what fits before it cannot fit better further on.
  std::size_t p = 0, n = 0;
  std::size_t star = std::string_view::npos, star_end = 0;
  while (n < name.size()) {
    if (p < pattern.size() && pattern[p] == '*') {
      star = p++;
      star_end = n;
    } else if (p < pattern.size() && pattern[p] == name[n]) {
      ++p, ++n;
    } else if (star != std::string_view::npos) {
      p = star + 1;
      n = ++star_end;
    } else {
      return false;
    }
  }
  return pattern.find_first_not_of('*', p) == std::string_view::npos;
}

std::vector<std::string> collect_sources(const Model& model) {
  std::set<std::string> names;
  std::set<const Expression*> seen;
  for (const SourceDeclaration& source : model.sources) names.insert(source.name);
  for (const Behaviour& behaviour : model.behaviours) {
    for (const Config& config : behaviour.configs) names.insert(config.source);
    for (const Condition& each : behaviour.conditions) {
      add_sources_of(*each.expression, names, seen);
    }
  }
  for (const Select& select : model.selects) {
    names.insert(select.source);
    add_sources_of(*select.condition, names, seen);
  }
  return {names.begin(), names.end()};
}

std::string similar_pattern(const std::string& pattern,
                            const std::vector<std::string_view>& names) {
  const std::size_t star = pattern.find('*');
  if (star == std::string::npos) return find_similar(pattern, names).value_or("");
  std::string before = pattern.substr(0, star);
  if (!before.empty() && before.front() != '/') before.insert(0, 1, '/');
  std::set<std::string> candidates;
  for (const std::string_view name : names) {
    for (const std::string_view beginning :
         {same_beginning(name, before), same_parts(name, before)}) {
      if (beginning.empty()) continue;
      std::string candidate = std::string(beginning) + pattern.substr(star);
      if (matches(candidate, name)) candidates.insert(std::move(candidate));
    }
  }
  return find_similar(pattern, {candidates.begin(), candidates.end()}).value_or("");
}

// Conditions are no deeper than kMaxConditionDepth, hence recursion is fine.
ExpressionPtr QuantifierExpansion::expand(const ExpressionPtr& expression) {
  switch (expression->op) {
    case Operator::kAny:
    case Operator::kAll:
    case Operator::kNone:
      return expand_quantifier(*expression);
    default:
      break;
  }
  std::vector<ExpressionPtr> operands;
  bool differs = false;
  for (const ExpressionPtr& operand : expression->operands) {
    operands.push_back(expand(operand));
    differs = differs || operands.back() != operand;
  }
  return differs ? make_operation(expression->op, std::move(operands)) : expression;
}

ExpressionPtr QuantifierExpansion::expand_quantifier(const Expression& quantifier) {
  ExpressionPtr& expanded = expanded_[{quantifier.op, quantifier.name}];
  if (expanded != nullptr) return expanded;
  std::vector<ExpressionPtr> operands;
  for (const std::string& source : sources_) {
    if (!matches(quantifier.name, source)) continue;
    const ExpressionPtr active = make_source(source);
    operands.push_back(quantifier.op == Operator::kNone ? make_operation(Operator::kNot, {active})
                                                        : active);
  }
  const bool is_any = quantifier.op == Operator::kAny;
  if (operands.empty()) {
    unmatched_.push_back(quantifier.name);
    expanded = make_constant(!is_any);
  } else if (operands.size() == 1) {
    expanded = operands.front();
  } else {
    expanded = make_operation(is_any ? Operator::kOr : Operator::kAnd, std::move(operands));
  }
  return expanded;
}

}  // namespace arbiter::rules
