#include "drawing/only_ports.hpp"

#include <algorithm>
#include <vector>

#include "rules/model/hierarchy.hpp"

namespace arbiter::drawing {
namespace {

using rules::Behaviour;
using rules::Hierarchy;

class Choice {
 public:
  Choice(const rules::Model& model, const std::set<std::string>& ports)
      : model_(model),
        hierarchy_(model, ignored_),
        configures_(model.behaviours.size(), false),
        is_chosen_(model.behaviours.size(), false) {
    for (std::size_t b = 0; b < model.behaviours.size(); ++b) {
      const auto& configs = model.behaviours[b].configs;
      const bool wants_one =
          std::any_of(configs.begin(), configs.end(),
                      [&](const rules::Config& config) { return ports.contains(config.port); });
      if (!wants_one) continue;
      for (std::size_t at = b; at != Hierarchy::kNobody && !configures_[at];
           at = hierarchy_.parent(at)) {
        configures_[at] = is_chosen_[at] = true;
      }
    }
    add_silencers();
  }

  [[nodiscard]] const std::vector<bool>& chosen() const { return is_chosen_; }

 private:
  // One that has no connection there silences it by the activity of all its sources.
  void add_silencers() {
    for (std::size_t b = 0; b < model_.behaviours.size(); ++b) {
      if (!configures_[b]) continue;
      for (const Hierarchy::Inhibitor& inhibitor : hierarchy_.inhibitors(b)) {
        if (!configures_[inhibitor.behaviour]) choose_all_in(inhibitor.behaviour);
      }
    }
  }

  void choose_all_in(std::size_t behaviour) {
    std::vector<std::size_t> left{behaviour};
    while (!left.empty()) {
      const std::size_t at = left.back();
      left.pop_back();
      is_chosen_[at] = true;
      const auto& children = hierarchy_.children(at);
      left.insert(left.end(), children.begin(), children.end());
    }
  }

  const rules::Model& model_;
  rules::Diagnostics ignored_;  // it was all reported when the model was loaded
  const Hierarchy hierarchy_;
  std::vector<bool> configures_;  // it, or one in it
  std::vector<bool> is_chosen_;
};

void reduce(rules::Model& model, const std::set<std::string>& ports) {
  const std::vector<bool> chosen = Choice(model, ports).chosen();
  std::set<std::string> names;
  std::vector<Behaviour> behaviours;
  for (std::size_t b = 0; b < chosen.size(); ++b) {
    if (!chosen[b]) continue;
    names.insert(model.behaviours[b].name);
    behaviours.push_back(std::move(model.behaviours[b]));
  }
  const auto is_left_out = [&](const rules::Mention& mention) {
    return !names.contains(mention.name);
  };
  for (Behaviour& behaviour : behaviours) {
    std::erase_if(behaviour.children, is_left_out);
    std::erase_if(behaviour.inhibitions, is_left_out);
  }
  model.behaviours = std::move(behaviours);
}

std::set<std::string> sources_of(const rules::RuleSet& rules) {
  std::set<std::string> sources;
  std::set<const rules::Expression*> seen;
  for (const rules::PortRules& port : rules.ports) {
    for (const rules::ConnectionRule& rule : port.rules) {
      sources.insert(rule.source);
      rules::add_sources_of(*rule.condition, sources, seen);
    }
  }
  for (const rules::Connection& connection : rules.other_connections) {
    sources.insert(connection.source);
  }
  return sources;
}

}  // namespace

rules::LoadedModel only_ports(const rules::LoadedModel& model, const std::set<std::string>& ports) {
  rules::LoadedModel part = model;
  reduce(part.model, ports);
  std::erase_if(part.rules.ports,
                [&](const rules::PortRules& port) { return !ports.contains(port.port); });
  std::erase_if(part.rules.other_connections, [&](const rules::Connection& connection) {
    return !ports.contains(connection.port);
  });
  const auto sources = sources_of(part.rules);
  std::erase_if(part.rules.sources,
                [&](const std::string& source) { return !sources.contains(source); });
  return part;
}

}  // namespace arbiter::drawing
