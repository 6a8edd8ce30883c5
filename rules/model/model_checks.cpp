#include "rules/model/model_checks.hpp"

#include <algorithm>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <string_view>
#include <unordered_map>
#include <unordered_set>
#include <utility>
#include <vector>

#include "rules/model/hosts.hpp"
#include "rules/text/names.hpp"
#include "shm/limits.hpp"

namespace arbiter::rules {
namespace {

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
        add_sources_of(*rule.condition, sources, seen);
      }
    }
    report(sources.size(), shm::kMaxSourcesPerPort,
           "sources at " + std::string(name) + ", connected or read by its rules", *where,
           "connect and mention fewer there", {.ports = {std::string(name)}});
  }

  // At the first connection that is one too many.
  void check_count(const std::vector<Place>& connections, std::size_t limit,
                   const std::string& what, const std::string& advice) {
    if (connections.size() <= limit) return;
    report(connections.size(), limit, what, *connections[limit].where, advice);
  }

  void report(std::size_t count, std::size_t limit, const std::string& what, const Location& where,
              const std::string& advice, Subject about = {}) {
    if (count <= limit) return;
    diagnostics_.error("limit-exceeded", where,
                       "there are " + std::to_string(count) + ' ' + what +
                           ", more than the limit of " + std::to_string(limit) + "; " + advice,
                       std::move(about));
  }

  const RuleSet& rules_;
  Diagnostics& diagnostics_;
  std::vector<Place> connections_;  // in document order, as in the lists of these
  std::map<std::string_view, std::vector<Place>> at_port_;
  std::map<std::string_view, std::vector<Place>> of_source_;
};

// Where each source is first written that a condition reads.
std::map<std::string_view, const Location*> places_of_reads(const Model& model) {
  std::map<std::string_view, const Location*> places;
  std::unordered_set<const Expression*> seen;
  const auto add = [&](const ExpressionPtr& condition, const Location& where) {
    std::unordered_set<std::string_view> reads;
    add_sources_of(*condition, reads, seen);
    for (const std::string_view source : reads) places.emplace(source, &where);
  };
  for (const Behaviour& behaviour : model.behaviours) {
    for (const Condition& condition : behaviour.conditions) {
      add(condition.expression, condition.where);
    }
  }
  for (const Select& select : model.selects) add(select.condition, select.where);
  // That only a quantifier stands for.
  for (const SourceDeclaration& source : model.sources) places.emplace(source.name, &source.where);
  return places;
}

// Sources that rules read and that nobody publishes, as far as the application tells: they have no
// connection, and no module has ports that are called so. Without modules it tells nothing.
class UnpublishedSources {
 public:
  UnpublishedSources(const Application& application, const Model& model, Diagnostics& diagnostics)
      : diagnostics_(diagnostics), places_(places_of_reads(model)) {
    for (const Application::Link& link : application.connections) published_.insert(link.source);
    connected_.assign(published_.begin(), published_.end());
    prefixes_.assign(application.prefixes.begin(), application.prefixes.end());
  }

  void warn(const RuleSet& rules) {
    std::set<std::string_view> known;  // that are fine, or reported
    // A connection that the application lacks is an error of its own.
    for (const PortRules& port : rules.ports) {
      for (const ConnectionRule& rule : port.rules) known.insert(rule.source);
    }
    std::unordered_set<const Expression*> seen;
    for (const PortRules& port : rules.ports) {
      for (const ConnectionRule& rule : port.rules) {
        std::unordered_set<std::string_view> reads;
        add_sources_of(*rule.condition, reads, seen);
        for (const std::string_view source : std::set(reads.begin(), reads.end())) {
          if (!known.insert(source).second || published_.contains(source) || has_module(source)) {
            continue;
          }
          warn(source, rule, port.port);
        }
      }
    }
  }

 private:
  [[nodiscard]] bool has_module(std::string_view source) const {
    return std::any_of(prefixes_.begin(), prefixes_.end(),
                       [&](std::string_view prefix) { return begins_with_prefix(source, prefix); });
  }

  // What one who has misspelt it may have meant: a source of a connection, or of a module.
  std::optional<std::string> meant_by(std::string_view source) {
    if (++reported_ > kMaxSuggestions) return std::nullopt;
    if (auto similar = find_similar(source, connected_)) return similar;
    for (std::size_t end = 1; end < source.size(); ++end) {
      if (source[end] != '/' && source[end] != ':') continue;
      const auto similar = find_similar(source.substr(0, end), prefixes_);
      if (similar) return *similar + std::string(source.substr(end));
    }
    return std::nullopt;
  }

  void warn(std::string_view source, const ConnectionRule& rule, const std::string& port) {
    const auto place = places_.find(source);
    const auto meant = meant_by(source);
    diagnostics_.warning(
        "never-published", place == places_.end() ? rule.where : *place->second,
        "the rule of " + rule.source + " at " + port + " reads " + std::string(source) +
            ", which no connection and no module of the application publishes: it will never be "
            "active" +
            (!meant ? std::string("; correct the name, or add the module whose <prefix> or <name> "
                                  "it begins with")
             : meant->starts_with('/')
                 ? "; did you mean " + quote(*meant) + "?"
                 : "; put a slash in front of " + quote(*meant) + " in the application"),
        {.ports = {port}, .source = std::string(source)});
  }

  Diagnostics& diagnostics_;
  const std::map<std::string_view, const Location*> places_;
  std::set<std::string_view> published_;
  std::vector<std::string_view> connected_;  // the same
  std::vector<std::string_view> prefixes_;
  std::size_t reported_ = 0;
};

// The end that is misspelt of a connection that the application does not have: of two ends, one
// will be right.
class MeantEnds {
 public:
  explicit MeantEnds(const Application& application) {
    for (const Application::Link& link : application.connections) {
      sources_at_[link.port].push_back(link.source);
      ports_of_[link.source].push_back(link.port);
    }
  }

  std::string advise(const std::string& source, const std::string& port) {
    std::string advice = "add it there, or correct the names here";
    if (++asked_ > kMaxSuggestions) return advice;
    const auto reversed = sources_at_.find(source);
    if (reversed != sources_at_.end() && std::find(reversed->second.begin(), reversed->second.end(),
                                                   port) != reversed->second.end()) {
      return "exchange the two ends of that from " + port + " to " + source + " there";
    }
    const auto look_in = [](const Ends& ends, const std::string& right, const std::string& wrong) {
      const auto found = ends.find(right);
      return found == ends.end() ? std::nullopt : find_similar(wrong, found->second);
    };
    auto meant = look_in(sources_at_, port, source);
    if (!meant) meant = look_in(ports_of_, source, port);
    if (!meant) return advice;
    // Whoever writes that here is told to put a slash in front.
    if (!meant->starts_with('/')) return "put a slash in front of " + quote(*meant) + " there";
    return advice + ": did you mean " + quote(*meant) + "?";
  }

 private:
  using Ends = std::map<std::string_view, std::vector<std::string_view>>;
  Ends sources_at_;
  Ends ports_of_;
  std::size_t asked_ = 0;
};

}  // namespace

void check_sources(const Model& model, Diagnostics& diagnostics) {
  std::unordered_map<std::string_view, const SourceDeclaration*> known;
  for (const SourceDeclaration& source : model.sources) {
    const auto [first, is_new] = known.emplace(source.name, &source);
    if (is_new) continue;
    diagnostics.error("duplicate-source", source.where,
                      "the source " + source.name + " is declared already, at " +
                          describe(first->second->where) + "; remove one of the two",
                      {.source = source.name});
  }
}

void check_application(const Application& application, const Model& model, RuleSet& rules,
                       Diagnostics& diagnostics) {
  std::set<std::pair<std::string_view, std::string_view>> selected;
  std::set<std::pair<std::string_view, std::string_view>> connected;
  for (const Application::Link& link : application.connections) {
    connected.emplace(link.source, link.port);
  }
  MeantEnds ends(application);
  for (const PortRules& port : rules.ports) {
    for (const ConnectionRule& rule : port.rules) {
      selected.emplace(rule.source, port.port);
      if (application.is_incomplete || connected.count({rule.source, port.port}) != 0) continue;
      diagnostics.error("not-in-application", rule.where,
                        "the application has no connection from " + rule.source + " to " +
                            port.port + "; " + ends.advise(rule.source, port.port),
                        {.ports = {port.port}, .source = rule.source, .behaviour = rule.behaviour});
    }
  }
  if (!application.prefixes.empty() && !application.is_incomplete) {
    UnpublishedSources(application, model, diagnostics).warn(rules);
  }
  for (const Application::Link& link : application.connections) {
    if (selected.count({link.source, link.port}) == 0) {
      rules.other_connections.push_back({link.source, link.port, link.where});
    }
  }
}

void note_unarbitrated(const Application& application, const RuleSet& rules,
                       Diagnostics& diagnostics) {
  std::set<std::string_view> arbitrated;
  for (const PortRules& port : rules.ports) arbitrated.insert(port.port);
  std::map<std::string_view, std::vector<const Application::Link*>> links_at;
  for (const Application::Link& link : application.connections) {
    if (!arbitrated.contains(link.port)) links_at[link.port].push_back(&link);
  }
  for (const auto& [port, links] : links_at) {
    if (links.size() < 2) continue;
    std::vector<std::string> sources;
    for (const Application::Link* link : links) sources.push_back(link->source);
    diagnostics.note("not-arbitrated", links[1]->where,
                     enumerate(sources) + " are connected to " + std::string(port) +
                         ", and no rule decides there: it takes what each of them sends, as it "
                         "comes; where one is to command at a time, write a <config> or a <select> "
                         "for each of them",
                     {.ports = {std::string(port)}});
  }
}

void note_commands_forever(const Model& model, const RuleSet& rules, const Location& whole,
                           Diagnostics& diagnostics) {
  std::map<std::string, std::vector<std::string>> ports_of;
  for (const PortRules& port : rules.ports) {
    for (const ConnectionRule& rule : port.rules) {
      if (rules.timeout_of(rule.source) == shm::kForever)
        ports_of[rule.source].push_back(port.port);
    }
  }
  if (ports_of.empty()) return;
  std::map<std::string_view, const Location*> declared;
  for (const SourceDeclaration& source : model.sources) {
    if (source.timeout) declared.emplace(source.name, &source.where);
  }
  const auto note = [&](const Location& where, const std::vector<std::string>& sources,
                        const std::vector<std::string>& ports) {
    const bool one = sources.size() == 1;
    diagnostics.note(
        "forever-commands", where,
        enumerate(sources) + (one ? " commands " : " command ") + enumerate(ports) +
            (one ? ", and its T is forever: if its" : ", and their T is forever: if a") +
            " process is killed, its activity does not end, and the port does not fall back to "
            "another source by itself; give " +
            (one ? "it" : "them") +
            " a finite T, or make sure that something deactivates a source that has died (arbiter "
            "deactivate)");
  };
  std::vector<std::string> by_default;
  std::set<std::string> ports_by_default;
  for (const auto& [source, ports] : ports_of) {
    if (const auto own = declared.find(source); own != declared.end()) {
      note(*own->second, {source}, ports);
    } else {
      by_default.push_back(source);
      ports_by_default.insert(ports.begin(), ports.end());
    }
  }
  if (by_default.empty()) return;
  const Location where = model.timeout ? model.timeout->where : whole;
  note(where, by_default, {ports_by_default.begin(), ports_by_default.end()});
}

void check_limits(const RuleSet& rules, const Application* application, const Location& whole,
                  const DocumentOrder& order, Diagnostics& diagnostics) {
  LimitCheck(rules, application, order, diagnostics).check(whole);
}

}  // namespace arbiter::rules
