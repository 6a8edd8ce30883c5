#include "rules/prove/in_order.hpp"

#include <unordered_map>

namespace arbiter::rules {
namespace {

using shm::Word;
using shm::table::kFalse;
using shm::table::kTrue;

class Sequence {
 public:
  explicit Sequence(const CompiledPort& port) : rules_(port.rules) {}

  InOrder build() {
    number_reads();
    std::size_t size = 0;
    for (const auto& rule : rules_) size += nodes_of(rule);
    place_chain(size);
    for (std::size_t i = 0; i < rules_.size(); ++i) {
      InOrder::Entry& entry = result_.entries[i];
      entry.root = nodes_of(rules_[i]) == 0 ? entry.before : end();
      append(rules_[i], entry.before, kFalse);
    }
    for (std::size_t i = rules_.size(); i-- > 0;) {
      if (rules_[i].kind == shm::table::kNever) continue;
      const Word next = result_.entries[i].before;
      const Word condition = nodes_of(rules_[i]) == 0 ? kFalse : end() + 1;
      result_.nodes.push_back({place_.at(rules_[i].source), next, condition});
      append(rules_[i], kFalse, next);
    }
    return std::move(result_);
  }

  static std::size_t nodes_of(const CompiledRule& rule) {
    return rule.kind == shm::table::kConjunction ? rule.reads.size() : rule.nodes.size();
  }

 private:
  [[nodiscard]] Word end() const { return static_cast<Word>(result_.nodes.size()); }

  void mention(const std::string& source) {
    if (place_.emplace(source, static_cast<Word>(result_.reads.size())).second) {
      result_.reads.push_back(source);
    }
  }

  // By first mention, so that a connection reads nothing of those behind it.
  void number_reads() {
    for (const auto& rule : rules_) {
      for (const auto& read : rule.reads) mention(read);
      result_.entries.emplace_back().reads = result_.reads.size();
      if (rule.kind != shm::table::kNever) mention(rule.source);
    }
  }

  // The rules stand in the chain from the last to the first, behind all own conditions.
  void place_chain(std::size_t at) {
    std::vector<Word> begins(rules_.size());
    for (std::size_t i = rules_.size(); i-- > 0;) {
      begins[i] = static_cast<Word>(at);
      if (rules_[i].kind != shm::table::kNever) at += 1 + nodes_of(rules_[i]);
    }
    Word before = kTrue;
    for (std::size_t i = 0; i < rules_.size(); ++i) {
      result_.entries[i].before = before;
      if (rules_[i].kind != shm::table::kNever) before = begins[i];
    }
  }

  void append(const CompiledRule& rule, Word if_true, Word if_false) {
    const Word first = end();
    const auto target = [&](Word node) {
      if (node == kTrue) return if_true;
      return node == kFalse ? if_false : first + node;
    };
    for (std::size_t i = 0; i < rule.expected.size(); ++i) {
      const Word next = i + 1 == rule.expected.size() ? kTrue : static_cast<Word>(i + 1);
      const Word low = rule.expected[i] ? kFalse : next, high = rule.expected[i] ? next : kFalse;
      result_.nodes.push_back({place_.at(rule.reads[i]), target(low), target(high)});
    }
    for (const auto& node : rule.nodes) {
      result_.nodes.push_back(
          {place_.at(rule.reads[node.position]), target(node.low), target(node.high)});
    }
  }

  const std::vector<CompiledRule>& rules_;
  InOrder result_;
  std::unordered_map<std::string, Word> place_;  // in result_.reads
};

}  // namespace

InOrder put_in_order(const CompiledPort& port) { return Sequence(port).build(); }

std::size_t nodes_in_order(const CompiledPort& port) {
  std::size_t nodes = 0;
  for (const auto& rule : port.rules) nodes += 1 + 2 * Sequence::nodes_of(rule);
  return nodes;
}

}  // namespace arbiter::rules
