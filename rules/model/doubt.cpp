#include "rules/model/doubt.hpp"

#include <algorithm>
#include <cstddef>
#include <vector>

namespace arbiter::rules {
namespace {

bool has_quantifier(const Expression& expression) {
  // Conditions are no deeper than kMaxConditionDepth, hence recursion is fine.
  return expression.op == Operator::kAny || expression.op == Operator::kAll ||
         expression.op == Operator::kNone ||
         std::any_of(expression.operands.begin(), expression.operands.end(),
                     [](const ExpressionPtr& operand) { return has_quantifier(*operand); });
}

class DoubtFinder {
 public:
  DoubtFinder(const Model& model, const Hierarchy& hierarchy)
      : model_(model), hierarchy_(hierarchy), in_doubt_(model.behaviours.size(), false) {}

  Doubts find(const Diagnostics& found) {
    doubts_.everything = model_.has_unknown_gaps || model_.lacks_arbiters;
    for (const Diagnostic& item : found.items()) add(item);
    for (const Omission& omission : found.omissions()) {
      if (omission.severity == Severity::kError) doubts_.everything = true;
    }
    if (doubts_.everything) return std::move(doubts_);
    for (const Arbiter& arbiter : model_.arbiters) {
      if (arbiter.is_incomplete) doubts_.ports.insert(arbiter.port);
    }
    // A behaviour that was refused may inhibit any other; a <config> that was may be one more that
    // selects a connection of any other.
    const bool lacks_configs =
        std::any_of(model_.behaviours.begin(), model_.behaviours.end(),
                    [](const Behaviour& each) { return !each.is_meta && each.lacks_parts; });
    if (lacks_configs || !model_.refused_names.empty()) in_doubt_.assign(in_doubt_.size(), true);
    judge_behaviours();
    if (model_.lacks_sources) doubt_quantifiers();
    for (std::size_t b = 0; b < in_doubt_.size(); ++b) {
      if (in_doubt_[b]) add_ports_below(b);
    }
    return std::move(doubts_);
  }

 private:
  // A limit of the whole model is about all of it.
  void add(const Diagnostic& item) {
    if (item.severity != Severity::kError) return;
    doubts_.ports.insert(item.about.ports.begin(), item.about.ports.end());
    const bool is_about_something = !item.about.ports.empty() || !item.about.behaviour.empty();
    if (item.code == "limit-exceeded" && !is_about_something) doubts_.everything = true;
  }

  void judge_behaviours() {
    const std::size_t count = in_doubt_.size();
    std::vector<bool> inhibits_any(count + 1,
                                   false);   // by parent, that of none last: some child does
    std::vector<bool> speaks(count, false);  // by sources of which not all are known
    const auto place = [&](std::size_t parent) { return std::min(parent, count); };
    for (std::size_t b = 0; b < count; ++b) {
      const Behaviour& behaviour = model_.behaviours[b];
      const Hierarchy::Doubt& doubt = hierarchy_.doubt(b);
      if (behaviour.is_incomplete || doubt.of_rule) in_doubt_[b] = true;
      if (behaviour.lacks_inhibitions || doubt.of_inhibitions) {
        inhibits_any[place(hierarchy_.parent(b))] = true;
      }
      if (!behaviour.lacks_parts && !doubt.of_parts) continue;
      // Any that seems to be in no meta-behaviour may be in this one.
      if (behaviour.is_meta) inhibits_any[count] = true;
      for (std::size_t at = b; at != Hierarchy::kNobody && !speaks[at];
           at = hierarchy_.parent(at)) {
        speaks[at] = true;
      }
    }
    for (std::size_t b = 0; b < count; ++b) {
      if (inhibits_any[place(hierarchy_.parent(b))]) in_doubt_[b] = true;
      for (const Hierarchy::Inhibitor& inhibitor : hierarchy_.inhibitors(b)) {
        if (speaks[inhibitor.behaviour]) in_doubt_[b] = true;
      }
    }
  }

  void doubt_quantifiers() {
    for (std::size_t b = 0; b < in_doubt_.size(); ++b) {
      const auto& conditions = model_.behaviours[b].conditions;
      if (std::any_of(conditions.begin(), conditions.end(), [](const Condition& condition) {
            return has_quantifier(*condition.expression);
          })) {
        in_doubt_[b] = true;
      }
    }
    for (const Select& select : model_.selects) {
      if (has_quantifier(*select.condition)) doubts_.ports.insert(select.port);
    }
  }

  void add_ports_below(std::size_t behaviour) {
    std::vector<std::size_t> pending{behaviour};
    while (!pending.empty()) {
      const std::size_t at = pending.back();
      pending.pop_back();
      for (const Config& config : model_.behaviours[at].configs) doubts_.ports.insert(config.port);
      for (const std::size_t child : hierarchy_.children(at)) {
        if (!in_doubt_[child]) pending.push_back(child);  // otherwise it has a turn of its own
      }
    }
  }

  const Model& model_;
  const Hierarchy& hierarchy_;
  Doubts doubts_;
  std::vector<bool> in_doubt_;  // by behaviour: its rules, and those of all below it
};

}  // namespace

Doubts find_doubts(const Model& model, const Hierarchy& hierarchy, const Diagnostics& found) {
  return DoubtFinder(model, hierarchy).find(found);
}

bool may_lack_names(const Model& model, const std::optional<Application>& application) {
  return model.has_unknown_gaps || model.lacks_sources || model.lacks_arbiters ||
         (application && application->is_incomplete);
}

}  // namespace arbiter::rules
