// Rules without files: expressions and rule sets made in a test.
#pragma once

#include <set>
#include <string>
#include <utility>
#include <vector>

#include "rules/model/rule_set.hpp"
#include "tests/support/meaning.hpp"

namespace arbiter::test {

using rules::ExpressionPtr;
using rules::Operator;

inline ExpressionPtr always() { return rules::make_constant(true); }
inline ExpressionPtr active(const std::string& source) { return rules::make_source(source); }
inline ExpressionPtr inactive(const std::string& source) {
  return rules::make_operation(Operator::kNot, {rules::make_source(source)});
}
inline ExpressionPtr negation(ExpressionPtr operand) {
  return rules::make_operation(Operator::kNot, {std::move(operand)});
}
inline ExpressionPtr all_of(std::vector<ExpressionPtr> operands) {
  return rules::make_operation(Operator::kAnd, std::move(operands));
}
inline ExpressionPtr any_of(std::vector<ExpressionPtr> operands) {
  return rules::make_operation(Operator::kOr, std::move(operands));
}
inline ExpressionPtr binary(Operator op, ExpressionPtr left, ExpressionPtr right) {
  return rules::make_operation(op, {std::move(left), std::move(right)});
}

inline bool holds(const rules::ConnectionRule& rule, const std::set<std::string>& active) {
  return active.contains(rule.source) && holds(*rule.condition, active);
}

// An expression may share parts, and be exponentially larger when written out.
inline void collect_names(const rules::Expression& e, std::set<std::string>& names,
                          std::set<const rules::Expression*>& seen) {
  if (!seen.insert(&e).second) return;
  if (e.op == Operator::kSource) names.insert(e.name);
  for (const auto& operand : e.operands) collect_names(*operand, names, seen);
}

// A rule set of ports given in any order; each rule stands on a line of its own in "model.xml".
class RulesByHand {
 public:
  RulesByHand& port(const std::string& name,
                    std::vector<std::pair<std::string, ExpressionPtr>> rules,
                    bool first_wins = false) {
    rules::PortRules port{name, first_wins, {"model.xml", ++line_, 1}, {}};
    for (auto& [source, condition] : rules) {
      port.rules.push_back({source, std::move(condition), {"model.xml", ++line_, 5}, {}});
    }
    set_.ports.push_back(std::move(port));
    return *this;
  }
  RulesByHand& other(const std::string& source, const std::string& port) {
    set_.other_connections.push_back({source, port, {"application.xml", ++line_, 3}});
    return *this;
  }
  RulesByHand& behaviour(const std::string& name, const std::string& port,
                         const std::string& source, ExpressionPtr condition) {
    rules::ConnectionRule rule{source, std::move(condition), {"model.xml", ++line_, 7}, name};
    set_.behaviours.push_back({name, {"model.xml", line_, 3}, {{port, std::move(rule)}}});
    return *this;
  }
  RulesByHand& timeout(const std::string& source, shm::Nanoseconds timeout) {
    set_.timeouts[source] = timeout;
    return *this;
  }

  operator rules::RuleSet() const {  // NOLINT: a rule set in the making is used as one
    rules::RuleSet result = set_;
    std::set<std::string> sources;
    std::set<const rules::Expression*> seen;
    for (const auto& port : result.ports) {
      for (const auto& rule : port.rules) {
        sources.insert(rule.source);
        collect_names(*rule.condition, sources, seen);
      }
    }
    for (const auto& [source, timeout] : result.timeouts) sources.insert(source);
    result.sources.assign(sources.begin(), sources.end());
    std::sort(result.ports.begin(), result.ports.end(),
              [](const auto& left, const auto& right) { return left.port < right.port; });
    return result;
  }

 private:
  rules::RuleSet set_;
  std::uint32_t line_ = 0;
};

}  // namespace arbiter::test
