#include "rules/table_rules.hpp"

#include <utility>
#include <vector>

namespace arbiter::rules {
namespace {

ExpressionPtr negate(ExpressionPtr operand) {
  return make_operation(Operator::kNot, {std::move(operand)});
}

// Successors lie behind their node, so that they are made before it.
ExpressionPtr diagram(const shm::Rule& rule, const std::vector<ExpressionPtr>& reads) {
  namespace table = shm::table;
  const shm::Word count = rule.nodes.count / table::kNodeWords;
  ExpressionPtr never = make_constant(false);
  ExpressionPtr always = make_constant(true);
  std::vector<ExpressionPtr> nodes(count);
  for (shm::Word node = count; node-- > 0;) {
    const shm::Word base = node * table::kNodeWords;
    const auto successor = [&](shm::Word at) {
      const shm::Word to = rule.nodes[base + at];
      if (to == table::kTrue) return always;
      return to > node && to < count ? nodes[to] : never;
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
  return count == 0 ? never : nodes[0];
}

ExpressionPtr condition_of(const shm::Rule& rule,
                           const std::function<std::string(shm::SourceId)>& source_name) {
  if (rule.kind == shm::table::kNever) return make_constant(false);
  std::vector<ExpressionPtr> reads;
  for (shm::Word i = 0; i < rule.reads.count; ++i) {
    reads.push_back(make_source(source_name(rule.reads[i] & ~shm::table::kExpectActive)));
  }
  if (rule.kind == shm::table::kDiagram) return diagram(rule, reads);
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
