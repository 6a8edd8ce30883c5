#include "rules/model_checks.hpp"

#include <map>
#include <set>
#include <string>
#include <string_view>
#include <unordered_map>
#include <unordered_set>
#include <vector>

#include "rules/names.hpp"
#include "shm/limits.hpp"

namespace arbiter::rules {
namespace {

// The names of all sources in a rule. Rules share much, hence what was seen is not seen again.
void collect_reads(const ExpressionPtr& expression, std::unordered_set<const Expression*>& seen,
                   std::unordered_set<std::string_view>& sources) {
  if (!seen.insert(expression.get()).second) return;
  if (expression->op == Operator::kSource) sources.insert(expression->name);
  for (const ExpressionPtr& operand : expression->operands) {
    collect_reads(operand, seen, sources);
  }
}

class LimitCheck {
 public:
  LimitCheck(const RuleSet& rules, const Application* application, Diagnostics& diagnostics)
      : rules_(rules), diagnostics_(diagnostics) {
    for (const PortRules& port : rules.ports) {
      for (const ConnectionRule& rule : port.rules) add(rule.source, port.port, rule.where);
    }
    if (application == nullptr) return;
    std::unordered_map<std::string_view, const Location*> places;
    std::set<std::pair<std::string_view, std::string_view>> others;
    for (const Connection& connection : rules.other_connections) {
      others.emplace(connection.source, connection.port);
    }
    for (const Application::Link& link : application->connections) {
      if (others.count({link.source, link.port}) != 0) add(link.source, link.port, link.where);
    }
  }

  void check(const Location& whole) {
    check_ports();
    std::unordered_set<std::string_view> sources(rules_.sources.begin(), rules_.sources.end());
    for (const auto& [source, count] : destinations_) sources.insert(source);
    report(connections_, shm::kMaxConnections, "connections", first_beyond_, "remove some");
    report(sources.size(), shm::kMaxSources, "sources", whole, "use fewer output ports");
    report(sources_at_.size(), shm::kMaxInputPorts, "input ports", whole, "use fewer of them");
  }

 private:
  void add(const std::string& source, const std::string& port, const Location& where) {
    if (++connections_ == shm::kMaxConnections + 1) first_beyond_ = where;
    sources_at_[port].push_back({&source, &where});
    auto& destinations = destinations_[source];
    if (++destinations.count == shm::kMaxDestinations + 1) destinations.first_beyond = where;
  }

  void check_ports() {
    for (const auto& [source, destinations] : destinations_) {
      report(destinations.count, shm::kMaxDestinations, "destinations of " + std::string(source),
             destinations.first_beyond, "connect it to fewer input ports");
    }
    std::unordered_map<std::string_view, const PortRules*> arbitrated;
    for (const PortRules& port : rules_.ports) arbitrated.emplace(port.port, &port);
    for (const auto& [port, connected] : sources_at_) {
      std::unordered_set<std::string_view> sources;
      for (const auto& [source, where] : connected) sources.insert(*source);
      const auto found = arbitrated.find(port);
      if (found != arbitrated.end()) {
        std::unordered_set<const Expression*> seen;
        for (const ConnectionRule& rule : found->second->rules) {
          collect_reads(rule.condition, seen, sources);
        }
      }
      const Location& where =
          found != arbitrated.end() ? found->second->where : *connected.front().second;
      report(sources.size(), shm::kMaxSourcesPerPort,
             "sources at " + std::string(port) + ", connected or read by its rules", where,
             "connect and mention fewer there");
    }
  }

  void report(std::size_t count, std::size_t limit, const std::string& what, const Location& where,
              const std::string& advice) {
    if (count <= limit) return;
    diagnostics_.error("limit-exceeded", where,
                       "there are " + std::to_string(count) + ' ' + what +
                           ", more than the limit of " + std::to_string(limit) + "; " + advice);
  }

  struct Destinations {
    std::size_t count = 0;
    Location first_beyond;
  };

  const RuleSet& rules_;
  Diagnostics& diagnostics_;
  std::size_t connections_ = 0;
  Location first_beyond_;
  std::map<std::string_view, std::vector<std::pair<const std::string*, const Location*>>>
      sources_at_;                                         // by port
  std::map<std::string_view, Destinations> destinations_;  // by source
};

}  // namespace

void check_sources(const Model& model, Diagnostics& diagnostics) {
  std::unordered_map<std::string_view, const SourceDeclaration*> known;
  for (const SourceDeclaration& source : model.sources) {
    const auto [first, is_new] = known.emplace(source.name, &source);
    if (is_new) continue;
    diagnostics.error("duplicate-source", source.where,
                      "the source " + source.name + " is declared already, at " +
                          describe(first->second->where) + "; remove one of the two");
  }
}

void check_application(const Application& application, RuleSet& rules, Diagnostics& diagnostics) {
  std::set<std::pair<std::string_view, std::string_view>> selected;
  std::set<std::pair<std::string_view, std::string_view>> connected;
  for (const Application::Link& link : application.connections) {
    connected.emplace(link.source, link.port);
  }
  for (const PortRules& port : rules.ports) {
    for (const ConnectionRule& rule : port.rules) {
      selected.emplace(rule.source, port.port);
      if (application.is_incomplete || connected.count({rule.source, port.port}) != 0) continue;
      diagnostics.error("not-in-application", rule.where,
                        "the application has no connection from " + rule.source + " to " +
                            port.port + "; add it there, or correct the names here");
    }
  }
  for (const Application::Link& link : application.connections) {
    if (selected.count({link.source, link.port}) == 0) {
      rules.other_connections.push_back({link.source, link.port});
    }
  }
}

void check_limits(const RuleSet& rules, const Application* application, const Location& whole,
                  Diagnostics& diagnostics) {
  LimitCheck(rules, application, diagnostics).check(whole);
}

}  // namespace arbiter::rules
