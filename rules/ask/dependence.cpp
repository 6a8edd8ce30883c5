#include "rules/ask/dependence.hpp"

#include <algorithm>

namespace arbiter::rules {

bool Dependence::needs(const std::string& source, const std::string& other, bool active) {
  const auto rule = std::find_if(port_.rules.begin(), port_.rules.end(),
                                 [&](const CompiledRule& each) { return each.source == source; });
  if (rule == port_.rules.end() || port_.in_order) return true;
  if (rule->kind == shm::table::kNever) return false;
  if (other == source) return active;
  const auto read = std::find(rule->reads.begin(), rule->reads.end(), other);
  if (read == rule->reads.end()) return false;
  if (rule->kind == shm::table::kConjunction) {
    return rule->expected[static_cast<std::size_t>(read - rule->reads.begin())] == active;
  }
  try {
    return ask(*rule, other, active);
  } catch (const DiagramLimit&) {
    wins_ = Diagram();
    of_ = nullptr;
    winners_.reset();
    return true;
  }
}

bool Dependence::ask(const CompiledRule& rule, const std::string& other, bool active) {
  if (!winners_) {
    SourceOrder order;
    order.add(port_);
    winners_.emplace(budget_, order, false);
  }
  if (of_ != &rule) {
    wins_ = winners_->winner(port_, rule);
    of_ = &rule;
  }
  return winners_->needs(wins_, other, active);
}

}  // namespace arbiter::rules
