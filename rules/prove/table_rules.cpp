#include "rules/prove/table_rules.hpp"

#include <algorithm>
#include <utility>
#include <vector>

namespace arbiter::rules {
namespace {

ExpressionPtr negate(ExpressionPtr operand) {
  return make_operation(Operator::kNot, {std::move(operand)});
}

// The connection's own condition: of rules in order, as far as to where those before it begin.
// Successors lie behind their node, so that they are made before it.
ExpressionPtr diagram(const shm::Rule& rule, const std::vector<ExpressionPtr>& reads) {
  namespace table = shm::table;
  const shm::Word count = rule.nodes.count / table::kNodeWords;
  ExpressionPtr never = make_constant(false);
  ExpressionPtr always = make_constant(true);
  const shm::Word end = rule.kind == table::kInOrder ? std::min(count, rule.before) : count;
  if (rule.root == rule.before) return always;
  if (rule.root >= end) return never;
  // The nodes between are those of others.
  std::vector<bool> is_own(end);
  is_own[rule.root] = true;
  for (shm::Word node = rule.root; node < end; ++node) {
    for (const shm::Word at : {table::kNodeLow, table::kNodeHigh}) {
      const shm::Word to = rule.nodes[node * table::kNodeWords + at];
      if (is_own[node] && to > node && to < end) is_own[to] = true;
    }
  }
  std::vector<ExpressionPtr> nodes(end);
  for (shm::Word node = end; node-- > rule.root;) {
    if (!is_own[node]) continue;
    const shm::Word base = node * table::kNodeWords;
    const auto successor = [&](shm::Word at) {
      const shm::Word to = rule.nodes[base + at];
      if (to == rule.before) return always;
      return to > node && to < end ? nodes[to] : never;
    };
    const shm::Word position = rule.nodes[base + table::kNodePosition];
    if (position >= reads.size()) {
      nodes[node] = never;
      continue;
    }
    const ExpressionPtr& read = reads[position];
    nodes[node] = make_operation(
        Operator::kOr,
        {make_operation(Operator::kAnd, {read, successor(table::kNodeHigh)}),
         make_operation(Operator::kAnd, {negate(read), successor(table::kNodeLow)})});
  }
  return nodes[rule.root];
}

ExpressionPtr condition_of(const shm::Rule& rule,
                           const std::function<std::string(shm::SourceId)>& source_name) {
  if (rule.kind == shm::table::kNever) return make_constant(false);
  std::vector<ExpressionPtr> reads;
  for (shm::Word i = 0; i < rule.reads.count; ++i) {
    reads.push_back(make_source(source_name(rule.reads[i] & ~shm::table::kExpectActive)));
  }
  if (rule.kind == shm::table::kDiagram || rule.kind == shm::table::kInOrder) {
    return diagram(rule, reads);
  }
  for (shm::Word i = 0; i < rule.reads.count; ++i) {
    if ((rule.reads[i] & shm::table::kExpectActive) == 0) reads[i] = negate(reads[i]);
  }
  return make_operation(Operator::kAnd, std::move(reads));
}

}  // namespace

RuleSet rules_of_table(const shm::TableView& table, shm::PortId port, const std::string& port_name,
                       const std::function<std::string(shm::SourceId)>& source_name) {
  RuleSet rules;
  PortRules result;
  result.port = port_name;
  const auto range = table.connections_to(port);
  for (auto index = range.first; index != range.first + range.count; ++index) {
    const shm::Rule rule = table.rule(index);
    const std::string source = source_name(rule.source);
    result.first_wins = result.first_wins || rule.kind == shm::table::kInOrder;
    if (rule.kind == shm::table::kNever || !table.is_arbitrated(port)) {
      rules.other_connections.push_back({source, port_name});
    } else {
      result.rules.push_back({source, condition_of(rule, source_name), {}, {}});
    }
  }
  if (table.is_arbitrated(port)) rules.ports.push_back(std::move(result));
  return rules;
}

}  // namespace arbiter::rules
