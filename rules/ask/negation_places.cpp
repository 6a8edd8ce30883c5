#include "rules/ask/negation_places.hpp"

#include <set>

#include "rules/model/polarity.hpp"
#include "rules/prove/rule_builder.hpp"

namespace arbiter::rules {

NegationPlaces::NegationPlaces(const RuleSet& rules, Budget& budget)
    : rules_(rules), budget_(budget), expansion_(rules.sources) {
  if (rules.provenance == nullptr) return;
  const Model& model = rules.provenance->model;
  for (const Select& select : model.selects) {
    selects_.try_emplace({select.source, select.port}, &select);
  }
  for (std::size_t b = 0; b < model.behaviours.size(); ++b) {
    for (const Config& config : model.behaviours[b].configs) {
      behaviours_[{config.source, config.port}].push_back(b);
    }
  }
}

Location NegationPlaces::find(const std::string& source, const PortRules& port,
                              const ConnectionRule& rule) {
  Location found = place(source, Asked::kInactive, port.port, rule);
  if (!found.file.empty() || !port.first_wins) return found.file.empty() ? rule.where : found;
  for (const ConnectionRule& earlier : port.rules) {
    if (&earlier == &rule) break;
    if (earlier.source == source) return earlier.where;
    found = place(source, Asked::kActive, port.port, earlier);
    if (!found.file.empty()) return found;
  }
  return rule.where;
}

Location NegationPlaces::place(const std::string& source, Asked asked, const std::string& port,
                               const ConnectionRule& rule) {
  if (const auto select = selects_.find({rule.source, port}); select != selects_.end()) {
    const bool has_it = asks(select->second->condition, source, asked);
    return has_it ? select->second->where : Location{};
  }
  const auto behaviours = behaviours_.find({rule.source, port});
  if (behaviours == behaviours_.end()) return {};
  for (const std::size_t behaviour : behaviours->second) {
    Location found = place_in_behaviour(source, asked, port, behaviour);
    if (!found.file.empty()) return found;
  }
  return {};
}

// As extraction joins it: the conditions of the behaviour and of all above it, then inhibitions.
Location NegationPlaces::place_in_behaviour(const std::string& source, Asked asked,
                                            const std::string& port, std::size_t behaviour) {
  const Model& model = rules_.provenance->model;
  const Hierarchy::Relations& relations = rules_.provenance->relations;
  for (std::size_t b = behaviour; b != Hierarchy::kNobody; b = relations.parents[b]) {
    for (const Condition& condition : model.behaviours[b].conditions) {
      if (asks(condition.expression, source, asked)) return condition.where;
    }
  }
  if (asked == Asked::kActive) return {};
  for (std::size_t b = behaviour; b != Hierarchy::kNobody; b = relations.parents[b]) {
    for (const Hierarchy::Inhibitor& inhibitor : relations.inhibitors[b]) {
      if (!speaks(source, port, inhibitor.behaviour)) continue;
      return model.behaviours[inhibitor.behaviour].inhibitions[inhibitor.mention].where;
    }
  }
  return {};
}

bool NegationPlaces::asks(const ExpressionPtr& condition, const std::string& source, Asked asked) {
  const ExpressionPtr expanded = expansion_.expand(condition);
  Polarity polarity;
  polarity.visit(*expanded);
  const bool is_active = asked == Asked::kActive;
  const auto& names = is_active ? polarity.required() : polarity.negated();
  const auto& others = is_active ? polarity.negated() : polarity.required();
  if (!names.contains(source)) return false;
  // One that is written both ways may come to nothing, as in "/a or not /a".
  return !others.contains(source) || depends(expanded, source, asked);
}

bool NegationPlaces::depends(const ExpressionPtr& condition, const std::string& source,
                             Asked asked) {
  try {
    DiagramBuilder builder(budget_, DiagramBuilder::kVariables, false);
    RuleBuilder rules(builder);
    std::set<std::string> written;
    rules.mention_all(*condition, written);
    if (written.size() >= shm::kMaxSourcesPerPort) return true;
    const std::string nobody;  // as the connection's own source, which is of no interest
    rules.mention(nobody);
    const Diagram holds = rules.rule({nobody, condition, {}, {}});
    return builder.needs(holds, rules.variable(source), asked == Asked::kActive);
  } catch (const DiagramLimit&) {
    return true;
  }
}

bool NegationPlaces::speaks(const std::string& source, const std::string& port,
                            std::size_t behaviour) const {
  bool is_here = false, is_anywhere = false, is_across_ports = true;
  std::vector<std::size_t> pending{behaviour};
  while (!pending.empty()) {
    const std::size_t at = pending.back();
    pending.pop_back();
    const auto& children = rules_.provenance->relations.children[at];
    pending.insert(pending.end(), children.begin(), children.end());
    for (const Config& config : rules_.provenance->model.behaviours[at].configs) {
      const bool is_at_port = config.port == port;
      is_across_ports = is_across_ports && !is_at_port;
      if (config.source != source) continue;
      (is_at_port ? is_here : is_anywhere) = true;
    }
  }
  return is_here || (is_across_ports && is_anywhere);
}

}  // namespace arbiter::rules
