#include "rules/prove/contradiction.hpp"

#include <algorithm>
#include <set>
#include <vector>

#include "rules/model/print_rules.hpp"
#include "rules/prove/rule_builder.hpp"

namespace arbiter::rules {
namespace {

constexpr std::size_t kMaxConnections = 3;  // explained of one behaviour
constexpr std::size_t kMaxDemands = 400;    // of one rule; each is left out once
constexpr std::size_t kMaxTextBytes = 200;  // of a demand as it is written

// What the rule asks for: the activity of its source, and each part of its condition.
std::vector<ExpressionPtr> demands_of(const ConnectionRule& rule) {
  std::vector<ExpressionPtr> demands{make_source(rule.source)};
  std::vector<ExpressionPtr> pending{rule.condition};
  while (!pending.empty() && demands.size() <= kMaxDemands) {
    const ExpressionPtr next = pending.back();
    pending.pop_back();
    if (next->op == Operator::kAnd) {
      pending.insert(pending.end(), next->operands.rbegin(), next->operands.rend());
    } else {
      demands.push_back(next);
    }
  }
  return demands;
}

bool can_hold(DiagramBuilder& builder, const std::vector<ExpressionPtr>& demands) {
  const std::string nobody = "=";  // a rule has a source; no real one is called so
  RuleBuilder expressions(builder);
  std::set<std::string> written;
  for (const auto& demand : demands) expressions.mention_all(*demand, written);
  if (written.size() >= static_cast<std::size_t>(DiagramBuilder::kVariables)) {
    throw DiagramLimit("too many sources");
  }
  expressions.mention(nobody);
  return !expressions.rule({nobody, make_operation(Operator::kAnd, demands), {}, {}}).is_false();
}

std::string written(const std::vector<ExpressionPtr>& demands) {
  std::string text;
  for (const auto& demand : demands) {
    std::string part = to_string(*demand);
    if (part.size() > kMaxTextBytes) return {};
    const bool is_simple = demand->op == Operator::kSource || demand->op == Operator::kNot;
    text += (text.empty() ? "" : " and ") + (is_simple ? part : "(" + part + ")");
  }
  return text;
}

// Empty if a bound is met, or if the demands do not contradict each other: then earlier rules of
// the port are in the way.
std::string contradiction_in(DiagramBuilder& builder, const ConnectionRule& rule) {
  std::vector<ExpressionPtr> demands = demands_of(rule);
  if (demands.size() > kMaxDemands) return {};
  try {
    builder.restore_order();
    if (can_hold(builder, demands)) return {};
    for (std::size_t i = demands.size(); i-- > 0;) {
      std::vector<ExpressionPtr> less = demands;
      less.erase(less.begin() + static_cast<std::ptrdiff_t>(i));
      if (!less.empty() && !can_hold(builder, less)) demands = std::move(less);
    }
  } catch (const DiagramLimit&) {
    return {};
  }
  return written(demands);
}

}  // namespace

std::string why_it_never_runs(DiagramBuilder& builder, const BehaviourRules& behaviour,
                              const RuleSet& rules) {
  std::string text;
  std::size_t count = 0;
  for (const auto& [port, rule] : behaviour.rules) {
    if (count == kMaxConnections) break;
    const std::string& name = port;
    const auto at = std::find_if(rules.ports.begin(), rules.ports.end(),
                                 [&](const auto& each) { return each.port == name; });
    const std::string contradiction = contradiction_in(builder, rule);
    std::string reason;
    if (!contradiction.empty()) {
      reason = "its connection from " + rule.source + " to " + port + " asks for ";
      reason += contradiction + ", which is never so";
    } else if (at != rules.ports.end() && at->first_wins) {
      reason = "whenever it asks for the connection from " + rule.source + " to " + port +
               ", an earlier one wins there, or one that conflict=\"first\" prefers";
    } else {
      continue;
    }
    text += (count++ == 0 ? ": " : ", and ") + reason;
  }
  return text;
}

}  // namespace arbiter::rules
