#include "rules/question.hpp"

#include <algorithm>

#include "rules/compile_port.hpp"

namespace arbiter::rules {

Diagram Scene::winner(const CompiledRule& rule) {
  if (const auto known = winner_.find(&rule); known != winner_.end()) return known->second;
  Diagram wins = winners_.winner(rule);
  winner_.emplace(&rule, wins);
  return wins;
}

Diagram Scene::idle(const CompiledPort& port) {
  const auto [found, is_new] = idle_.try_emplace(&port);
  Idle& idle = found->second;
  if (is_new) idle.states = winners_.constant(true);
  for (; idle.rules < port.rules.size(); ++idle.rules) {
    idle.states =
        winners_.combine(Connective::kAndNot, idle.states, winner(port.rules[idle.rules]));
  }
  return idle.states;
}

Question::Question(const Expression& expression, const std::vector<Term>& terms, Scene& scene)
    : expression_(expression), terms_(terms), scene_(scene), winners_(scene.winners()) {
  for (const Term& term : terms_) {
    const bool is_new = std::find(idle_.begin(), idle_.end(), term.port) == idle_.end();
    if (term.rule == nullptr && is_new) idle_.push_back(term.port);
  }
}

std::optional<Witness> Question::refute(Way way) {
  built_.clear();
  decided_.clear();
  const Diagram bad = way == Way::kByCases ? refute_by_cases(0, winners_.constant(true))
                                           : winners_.negate(build(expression_));
  if (bad.is_false()) return std::nullopt;
  return winners_.witness(bad);
}

// The winner at each port of idle_ is chosen in turn; what is left of the statement then reads few
// rules, and most often contradicts `state` at once.
Diagram Question::refute_by_cases(std::size_t next, const Diagram& state) {
  if (next == idle_.size()) {
    Diagram bad = winners_.combine(Connective::kAndNot, state, build(expression_));
    built_.clear();
    for (const auto& [port, winner] : decided_) {
      if (winner != nullptr) continue;
      for (const auto& rule : port->rules) {
        if (bad.is_false()) return bad;
        bad = winners_.combine(Connective::kAndNot, bad, scene_.winner(rule));
      }
    }
    return bad;
  }
  const CompiledPort* port = idle_[next];
  decided_[port] = nullptr;
  Diagram bad = refute_by_cases(next + 1, state);
  for (const auto& rule : port->rules) {
    if (!bad.is_false()) break;
    const Diagram wins = winners_.combine(Connective::kAnd, state, scene_.winner(rule));
    if (wins.is_false()) continue;
    decided_[port] = &rule;
    bad = refute_by_cases(next + 1, wins);
  }
  decided_.erase(port);
  return bad;
}

Diagram Question::build(const Expression& expression) {
  if (const auto known = built_.find(&expression); known != built_.end()) return known->second;
  Diagram result = build_new(expression);
  built_.emplace(&expression, result);
  return result;
}

Diagram Question::build_new(const Expression& expression) {
  const auto& operands = expression.operands;
  switch (expression.op) {
    case Operator::kFalse:
    case Operator::kTrue:
      return winners_.constant(expression.op == Operator::kTrue);
    case Operator::kSource:
      if (!expression.name.starts_with('=')) return winners_.active(expression.name);
      return build_term(terms_.at(std::stoul(expression.name.substr(1))));
    case Operator::kNot:
      return winners_.negate(build(*operands[0]));
    case Operator::kAnd:
    case Operator::kOr: {
      Diagram result = winners_.constant(expression.op == Operator::kAnd);
      for (std::size_t i = operands.size(); i-- > 0;) {
        result = winners_.combine(connective_of(expression.op), result, build(*operands[i]));
      }
      return result;
    }
    default: {
      const Diagram left = build(*operands[0]);
      return winners_.combine(connective_of(expression.op), left, build(*operands[1]));
    }
  }
}

Diagram Question::build_term(const Term& term) {
  if (const auto known = decided_.find(term.port); known != decided_.end()) {
    return winners_.constant(known->second == term.rule);
  }
  return term.rule != nullptr ? scene_.winner(*term.rule) : scene_.idle(*term.port);
}

}  // namespace arbiter::rules
