#include "rules/prove/question.hpp"

#include <algorithm>

#include "rules/prove/rule_builder.hpp"

namespace arbiter::rules {

Diagram Scene::winner(const CompiledPort& port, const CompiledRule& rule) {
  if (!port.in_order) return holds(rule);
  if (const auto known = winner_.find(&rule); known != winner_.end()) return known->second;
  Diagram wins = winners_.winner(port, rule);
  winner_.emplace(&rule, wins);
  return wins;
}

Diagram Scene::holds(const CompiledRule& rule) {
  if (const auto known = holds_.find(&rule); known != holds_.end()) return known->second;
  Diagram states = winners_.holds(rule);
  holds_.emplace(&rule, states);
  return states;
}

Diagram Scene::idle(const CompiledPort& port) {
  const auto [found, is_new] = idle_.try_emplace(&port);
  Idle& idle = found->second;
  if (is_new) idle.states = winners_.constant(true);
  for (; idle.rules < port.rules.size(); ++idle.rules) {
    idle.states = winners_.combine(Connective::kAndNot, idle.states, holds(port.rules[idle.rules]));
  }
  return idle.states;
}

Question::Question(const Expression& expression, const std::vector<Term>& terms, Scene& scene)
    : expression_(expression), terms_(terms), scene_(scene), winners_(scene.winners()) {
  for (const Term& term : terms_) {
    if (term.is_of_all()) add_whole(*term.port);
    if (term.other != nullptr) add_whole(*term.other);
  }
}

void Question::add_whole(const CompiledPort& port) {
  if (std::find(whole_.begin(), whole_.end(), &port) == whole_.end()) whole_.push_back(&port);
}

Diagram Question::if_it_won(const CompiledPort& port, const CompiledRule& rule) {
  built_.clear();
  decided_ = {{&port, &rule}};
  return build(expression_);
}

std::optional<Witness> Question::refute(Way way) {
  built_.clear();
  decided_.clear();
  const Diagram bad = way == Way::kByCases ? refute_by_cases(0, winners_.constant(true))
                                           : winners_.negate(build(expression_));
  if (bad.is_false()) return std::nullopt;
  return winners_.witness(bad);
}

// The winner at each port of whole_ is chosen in turn; what is left of the statement then reads few
// rules, and most often contradicts `state` at once.
Diagram Question::refute_by_cases(std::size_t next, const Diagram& state) {
  if (next == whole_.size()) {
    Diagram bad = winners_.combine(Connective::kAndNot, state, build(expression_));
    built_.clear();
    for (const auto& [port, winner] : decided_) {
      if (winner != nullptr) continue;
      for (const auto& rule : port->rules) {
        if (bad.is_false()) return bad;
        bad = winners_.combine(Connective::kAndNot, bad, scene_.holds(rule));
      }
    }
    return bad;
  }
  const CompiledPort* port = whole_[next];
  decided_[port] = nullptr;
  Diagram bad = refute_by_cases(next + 1, state);
  for (const auto& rule : port->rules) {
    if (!bad.is_false()) break;
    const Diagram wins = winners_.combine(Connective::kAnd, state, scene_.winner(*port, rule));
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
  if (term.other != nullptr) return build_same(*term.port, *term.other);
  if (const auto known = decided_.find(term.port); known != decided_.end()) {
    const auto* const winner = known->second;
    const auto& rules = term.rules;
    return winners_.constant(term.nobody
                                 ? winner == nullptr
                                 : std::find(rules.begin(), rules.end(), winner) != rules.end());
  }
  if (term.nobody) return scene_.idle(*term.port);
  Diagram result = winners_.constant(false);
  for (const auto* rule : term.rules) {
    result = winners_.combine(Connective::kOr, result, scene_.winner(*term.port, *rule));
  }
  return result;
}

// Each source wins at both or at neither: since only one can win at each, that is the same winner.
Diagram Question::build_same(const CompiledPort& port, const CompiledPort& other) {
  std::set<std::string> sources;
  for (const auto* each : {&port, &other}) {
    for (const auto& rule : each->rules) sources.insert(rule.source);
  }
  Diagram same = winners_.constant(true);
  for (const auto& source : sources) {
    const Diagram differ =
        winners_.combine(Connective::kXor, wins_at(port, source), wins_at(other, source));
    same = winners_.combine(Connective::kAndNot, same, differ);
  }
  return same;
}

Diagram Question::wins_at(const CompiledPort& port, const std::string& source) {
  if (const auto known = decided_.find(&port); known != decided_.end()) {
    return winners_.constant(known->second != nullptr && known->second->source == source);
  }
  for (const auto& rule : port.rules) {
    if (rule.source == source) return scene_.winner(port, rule);
  }
  return winners_.constant(false);
}

}  // namespace arbiter::rules
