#include "rules/model_checks.hpp"

#include <algorithm>
#include <map>
#include <set>
#include <string>
#include <string_view>
#include <unordered_map>
#include <unordered_set>
#include <utility>
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
  LimitCheck(const RuleSet& rules, const Application* application, const DocumentOrder& order,
             Diagnostics& diagnostics)
      : rules_(rules), diagnostics_(diagnostics) {
    for (const PortRules& port : rules.ports) {
      for (const ConnectionRule& rule : port.rules) {
        connections_.push_back({&rule.source, &port.port, &rule.where});
      }
    }
    add_others(application);
    std::sort(connections_.begin(), connections_.end(),
              [&](const Place& a, const Place& b) { return order(*a.where, *b.where); });
    for (const Place& connection : connections_) {
      at_port_[*connection.port].push_back(connection);
      of_source_[*connection.source].push_back(connection);
    }
  }

  void check(const Location& whole) {
    for (const auto& [source, connections] : of_source_) {
      check_count(connections, shm::kMaxDestinations, "destinations of " + std::string(source),
                  "connect it to fewer input ports");
    }
    for (const auto& [port, connections] : at_port_) check_port(port, connections);
    check_count(connections_, shm::kMaxConnections, "connections", "remove some");
    std::unordered_set<std::string_view> sources(rules_.sources.begin(), rules_.sources.end());
    for (const auto& [source, connections] : of_source_) sources.insert(source);
    report(sources.size(), shm::kMaxSources, "sources", whole, "use fewer output ports");
    report(at_port_.size(), shm::kMaxInputPorts, "input ports", whole, "use fewer of them");
  }

 private:
  struct Place {
    const std::string* source;
    const std::string* port;
    const Location* where;
  };

  void add_others(const Application* application) {
    if (application == nullptr) return;
    std::set<std::pair<std::string_view, std::string_view>> others;
    for (const Connection& connection : rules_.other_connections) {
      others.emplace(connection.source, connection.port);
    }
    for (const Application::Link& link : application->connections) {
      if (others.count({link.source, link.port}) == 0) continue;
      connections_.push_back({&link.source, &link.port, &link.where});
    }
  }

  void check_port(std::string_view name, const std::vector<Place>& connections) {
    std::unordered_set<std::string_view> sources;
    for (const Place& connection : connections) sources.insert(*connection.source);
    const Location* where = connections.front().where;
    const auto rules = std::lower_bound(
        rules_.ports.begin(), rules_.ports.end(), name,
        [](const PortRules& port, std::string_view wanted) { return port.port < wanted; });
    if (rules != rules_.ports.end() && rules->port == name) {
      where = &rules->where;
      std::unordered_set<const Expression*> seen;
      for (const ConnectionRule& rule : rules->rules) {
        collect_reads(rule.condition, seen, sources);
      }
    }
    report(sources.size(), shm::kMaxSourcesPerPort,
           "sources at " + std::string(name) + ", connected or read by its rules", *where,
           "connect and mention fewer there");
  }

  // At the first connection that is one too many.
  void check_count(const std::vector<Place>& connections, std::size_t limit,
                   const std::string& what, const std::string& advice) {
    if (connections.size() <= limit) return;
    report(connections.size(), limit, what, *connections[limit].where, advice);
  }

  void report(std::size_t count, std::size_t limit, const std::string& what, const Location& where,
              const std::string& advice) {
    if (count <= limit) return;
    diagnostics_.error("limit-exceeded", where,
                       "there are " + std::to_string(count) + ' ' + what +
                           ", more than the limit of " + std::to_string(limit) + "; " + advice);
  }

  const RuleSet& rules_;
  Diagnostics& diagnostics_;
  std::vector<Place> connections_;  // in document order, as in the lists of these
  std::map<std::string_view, std::vector<Place>> at_port_;
  std::map<std::string_view, std::vector<Place>> of_source_;
};

// Sources that rules read and that nobody publishes, as far as the application tells: they have no
// connection, and no module has ports that are called so. Without modules it tells nothing.
void warn_of_unpublished(const Application& application, const RuleSet& rules,
                         Diagnostics& diagnostics) {
  if (application.prefixes.empty() || application.is_incomplete) return;
  std::set<std::string_view> published;
  for (const Application::Link& link : application.connections) published.insert(link.source);
  const auto has_module = [&](std::string_view source) {
    return std::any_of(application.prefixes.begin(), application.prefixes.end(),
                       [&](const std::string& prefix) {
                         if (!source.starts_with(prefix)) return false;
                         const auto rest = source.substr(prefix.size());
                         return rest.empty() || rest[0] == '/' || rest[0] == ':';
                       });
  };
  std::set<std::string_view> known;  // that are fine, or reported
  std::unordered_set<const Expression*> seen;
  for (const PortRules& port : rules.ports) {
    for (const ConnectionRule& rule : port.rules) {
      std::unordered_set<std::string_view> reads;
      collect_reads(rule.condition, seen, reads);
      for (const std::string_view source : std::set(reads.begin(), reads.end())) {
        if (!known.insert(source).second || published.contains(source) || has_module(source)) {
          continue;
        }
        diagnostics.warning("never-published", rule.where,
                            "the rule of " + rule.source + " at " + port.port + " reads " +
                                std::string(source) +
                                ", which no connection and no module of the application "
                                "publishes: it will never be active; correct the name, or add "
                                "the module whose <prefix> or <name> it begins with");
      }
    }
  }
}

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
  warn_of_unpublished(application, rules, diagnostics);
  for (const Application::Link& link : application.connections) {
    if (selected.count({link.source, link.port}) == 0) {
      rules.other_connections.push_back({link.source, link.port, link.where});
    }
  }
}

void check_limits(const RuleSet& rules, const Application* application, const Location& whole,
                  const DocumentOrder& order, Diagnostics& diagnostics) {
  LimitCheck(rules, application, order, diagnostics).check(whole);
}

}  // namespace arbiter::rules
