#include "drawing/situation.hpp"

#include <algorithm>
#include <utility>

namespace arbiter::drawing {
namespace {

using rules::Operator;

// Of an expression whose quantifiers were expanded.
bool is_true(const rules::Expression& expression, const std::set<std::string>& active) {
  const auto& operands = expression.operands;
  const auto operand = [&](std::size_t i) { return is_true(*operands[i], active); };
  const auto each = [&](const rules::ExpressionPtr& part) { return is_true(*part, active); };
  switch (expression.op) {
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
      return false;
  }
}

}  // namespace

bool holds(const rules::ConnectionRule& rule, const std::set<std::string>& active) {
  return active.contains(rule.source) && is_true(*rule.condition, active);
}

Situation decide(const rules::RuleSet& rules, std::set<std::string> active) {
  Situation situation{std::move(active), {}};
  for (const rules::PortRules& port : rules.ports) {
    for (const rules::ConnectionRule& rule : port.rules) {
      // Where more than one may hold, the first one wins.
      if (holds(rule, situation.active)) situation.winners.emplace(port.port, rule.source);
    }
  }
  return situation;
}

State state_of(const rules::BehaviourRules& behaviour, const Situation& situation) {
  State state = State::kSilent;
  for (const auto& [port, rule] : behaviour.rules) {
    if (!situation.active.contains(rule.source)) continue;
    const auto winner = situation.winners.find(port);
    const bool wins = winner != situation.winners.end() && winner->second == rule.source;
    if (wins && holds(rule, situation.active)) return State::kRuns;
    state = State::kOverridden;
  }
  return state;
}

}  // namespace arbiter::drawing
