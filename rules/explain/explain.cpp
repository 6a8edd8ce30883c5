#include "rules/explain/explain.hpp"

#include <algorithm>
#include <iterator>
#include <map>
#include <set>
#include <string_view>
#include <unordered_map>
#include <unordered_set>
#include <utility>

#include "rules/explain/assume.hpp"
#include "rules/model/evaluation.hpp"
#include "rules/model/print_rules.hpp"
#include "rules/model/provenance.hpp"
#include "rules/model/quantifiers.hpp"

namespace arbiter::rules {
namespace {

Element element(const Behaviour& behaviour) {
  return {behaviour.name, behaviour.is_meta, behaviour.where};
}

// Explains connections of one port, under one activation.
class PortInquiry {
 public:
  PortInquiry(const RuleSet& rules, const std::string& port, const IsActive& is_active)
      : rules_(rules), port_(port), is_active_(is_active), expansion_(rules.sources) {
    const auto at = std::find_if(rules_.ports.begin(), rules_.ports.end(),
                                 [&](const PortRules& each) { return each.port == port_; });
    if (at == rules_.ports.end()) return;
    arbiter_ = &*at;
    winner_ = first_that_holds(is_active_, nullptr);
  }

  PortExplanation explain_all() {
    PortExplanation result;
    if (arbiter_ != nullptr) {
      gather_parts(nullptr);
      if (winner_ != nullptr) result.winner = winner_->source;
      for (const ConnectionRule& rule : arbiter_->rules) result.connections.push_back(of(rule));
      add_senses(result);
    }
    for (const Connection& connection : rules_.other_connections) {
      if (connection.port == port_) result.connections.push_back(of(connection));
    }
    return result;
  }

  std::optional<ConnectionExplanation> explain(const std::string& source) {
    if (arbiter_ != nullptr) {
      for (const ConnectionRule& rule : arbiter_->rules) {
        if (rule.source != source) continue;
        gather_parts(&source);
        return of(rule);
      }
    }
    for (const Connection& connection : rules_.other_connections) {
      if (connection.port == port_ && connection.source == source) return of(connection);
    }
    return std::nullopt;
  }

 private:
  // A source of a behaviour, as one that it may inhibit by.
  struct Voice {
    const std::string* source;
    std::size_t behaviour;
  };
  struct Voices {
    std::vector<Voice> active;
    std::unordered_set<std::string_view> inactive;
    bool across_ports = false;
  };
  struct ConfigPlace {
    std::size_t behaviour;
    const Config* config;
  };

  // Which behaviours configure a connection to the port, and which rules are written by hand.
  // `only`: of this source; null: of all.
  void gather_parts(const std::string* only) {
    if (rules_.provenance == nullptr) return;
    const auto is_wanted = [&](const auto& each) {
      return each.port == port_ && (only == nullptr || each.source == *only);
    };
    const Model& model = rules_.provenance->model;
    for (std::size_t b = 0; b < model.behaviours.size(); ++b) {
      for (const Config& config : model.behaviours[b].configs) {
        if (is_wanted(config)) configs_[config.source].push_back({b, &config});
      }
    }
    for (const Select& select : model.selects) {
      if (is_wanted(select)) selects_[select.source] = &select;
    }
  }

  // Of the rules before `end`, or of all; null: none holds.
  [[nodiscard]] const ConnectionRule* first_that_holds(const IsActive& is_active,
                                                       const ConnectionRule* end) const {
    Evaluation evaluation([&](const std::string& source) { return truth(is_active(source)); });
    for (const ConnectionRule& rule : arbiter_->rules) {
      if (&rule == end) break;
      if (is_active_(rule.source) && evaluation.of(*rule.condition) == Truth::kTrue) return &rule;
    }
    return nullptr;
  }

  // Who wins is what one sees: of several causes, each of which is enough, it stands in front.
  void put_winner_first(std::vector<Cause>& causes) const {
    if (winner_ == nullptr) return;
    std::stable_partition(causes.begin(), causes.end(), [&](const Cause& cause) {
      return std::find(cause.because.begin(), cause.because.end(),
                       Literal{winner_->source, true}) != cause.because.end();
    });
  }

  ConnectionExplanation of(const ConnectionRule& rule) {
    ConnectionExplanation result;
    result.source = rule.source;
    result.has_rule = true;
    result.is_active = is_active_(rule.source);
    result.parts = parts_of(rule);
    for (Part& part : result.parts) put_winner_first(part.causes);
    const bool may_hold = std::any_of(result.parts.begin(), result.parts.end(),
                                      [](const Part& part) { return part.causes.empty(); });
    result.holds = result.is_active && may_hold;
    result.wins = winner_ == &rule;
    if (may_hold && !result.wins) add_earlier(rule, result);
    return result;
  }

  ConnectionExplanation of(const Connection& connection) {
    ConnectionExplanation result;
    result.source = connection.source;
    result.is_active = is_active_(connection.source);
    result.where = connection.where;
    result.is_read = is_read(connection.source);
    return result;
  }

  // Where the rule's own source is active, it may end what keeps an earlier rule from holding, or
  // what lets it: all of them are asked once more.
  void add_earlier(const ConnectionRule& rule, ConnectionExplanation& result) const {
    const IsActive with_own = [&](const std::string& source) {
      return source == rule.source || is_active_(source);
    };
    const ConnectionRule* const earlier = first_that_holds(with_own, &rule);
    if (earlier == nullptr) return;
    result.earlier = earlier->source;
    const ExpressionPtr whole =
        make_operation(Operator::kAnd, {make_source(earlier->source), earlier->condition});
    result.earlier_because = sufficient_reason(*assume_active(whole, rule.source), with_own);
  }

  std::vector<Part> parts_of(const ConnectionRule& rule) {
    own_ = &rule.source;
    is_own_active_ = is_active_(rule.source);
    std::vector<Part> parts;
    if (rules_.provenance == nullptr) {
      parts.push_back({{}, rule.where, {}});
      add_condition(rule.condition, {}, {}, Cause::Kind::kUnwritten, parts.back());
      return parts;
    }
    if (const auto select = selects_.find(rule.source); select != selects_.end()) {
      parts.push_back({{}, select->second->where, {}});
      add_condition(select->second->condition, {}, select->second->where,
                    Cause::Kind::kConditionFalse, parts.back());
      return parts;
    }
    std::size_t last = Hierarchy::kNobody;
    for (const ConfigPlace& place : configs_[rule.source]) {
      if (std::exchange(last, place.behaviour) == place.behaviour) continue;  // configured twice
      parts.push_back(part_of(place));
    }
    return parts;
  }

  // The terms of docs/semantics.md: conditions of the behaviour and of all above it, then
  // inhibitions.
  Part part_of(const ConfigPlace& place) {
    const Model& model = rules_.provenance->model;
    const Hierarchy::Relations& relations = rules_.provenance->relations;
    Part part{element(model.behaviours[place.behaviour]), place.config->where, {}};
    for (std::size_t b = place.behaviour; b != Hierarchy::kNobody; b = relations.parents[b]) {
      for (const Condition& condition : model.behaviours[b].conditions) {
        add_condition(condition.expression, element(model.behaviours[b]), condition.where,
                      Cause::Kind::kConditionFalse, part);
      }
    }
    for (std::size_t b = place.behaviour; b != Hierarchy::kNobody; b = relations.parents[b]) {
      for (const auto& inhibitor : relations.inhibitors[b]) add_inhibition(inhibitor, b, part);
    }
    return part;
  }

  void add_condition(const ExpressionPtr& written, const std::optional<Element>& of,
                     const Location& where, Cause::Kind kind, Part& part) {
    const ExpressionPtr expanded = expansion_.expand(written);
    const ExpressionPtr left = assume_active(expanded, *own_);
    if (evaluate(*left, is_active_)) return;
    Cause cause;
    cause.kind = kind;
    cause.where = where;
    cause.of = of;
    if (kind == Cause::Kind::kConditionFalse) cause.condition = to_string(*written);
    cause.because =
        sufficient_reason(*left, is_active_, winner_ == nullptr ? nullptr : &winner_->source);
    const IsActive without_own = [this](const std::string& source) {
      return source != *own_ && is_active_(source);
    };
    if (left != expanded && evaluate(*expanded, without_own)) note_own_activity(cause);
    part.causes.push_back(std::move(cause));
  }

  void note_own_activity(Cause& cause) const {
    using OwnActivity = Cause::OwnActivity;
    cause.own_activity = is_own_active_ ? OwnActivity::kMatters : OwnActivity::kWillMatter;
  }

  void add_inhibition(const Hierarchy::Inhibitor& inhibitor, std::size_t inhibited, Part& part) {
    const Voices& voices = voices_of(inhibitor.behaviour);
    const bool is_own_a_voice =
        voices.inactive.count(*own_) != 0 ||
        std::any_of(voices.active.begin(), voices.active.end(),
                    [this](const Voice& voice) { return *voice.source == *own_; });
    if (voices.active.empty() && !is_own_a_voice) return;
    const auto& behaviours = rules_.provenance->model.behaviours;
    const Behaviour& by = behaviours[inhibitor.behaviour];
    Cause cause;
    cause.kind = Cause::Kind::kInhibited;
    cause.where = by.inhibitions[inhibitor.mention].where;
    cause.of = element(behaviours[inhibited]);
    cause.inhibitor = element(by);
    cause.across_ports = voices.across_ports;
    add_voices(voices, inhibitor.behaviour, is_own_a_voice, cause);
    part.causes.push_back(std::move(cause));
  }

  // Which sources inhibit. The connection's own is enough, where it is one of them; whether it
  // alone makes it so, the others tell.
  void add_voices(const Voices& voices, std::size_t inhibitor, bool is_own_a_voice, Cause& cause) {
    for (const Voice& voice : voices.active) {
      if (*voice.source == *own_) continue;
      cause.also.push_back(*voice.source);
    }
    if (is_own_a_voice) {
      if (cause.also.empty()) note_own_activity(cause);
    } else {
      const auto winner =
          std::find_if(voices.active.begin(), voices.active.end(), [this](const Voice& voice) {
            return winner_ != nullptr && *voice.source == winner_->source;
          });
      const Voice& first = winner == voices.active.end() ? voices.active.front() : *winner;
      if (first.behaviour != inhibitor) {
        cause.speaker = element(rules_.provenance->model.behaviours[first.behaviour]);
      }
      cause.because = {{*first.source, true}};
      std::erase(cause.also, *first.source);
    }
    std::sort(cause.also.begin(), cause.also.end());
    cause.also.erase(std::unique(cause.also.begin(), cause.also.end()), cause.also.end());
  }

  // The sources that speak for a behaviour here: those of its behaviours at the port or, where
  // there are none, all of them.
  const Voices& voices_of(std::size_t behaviour) {
    const auto [found, is_new] = voices_.try_emplace(behaviour);
    Voices& result = found->second;
    if (!is_new) return result;
    const Provenance& provenance = *rules_.provenance;
    std::vector<Voice> here, anywhere;
    std::vector<std::size_t> pending{behaviour};
    while (!pending.empty()) {
      const std::size_t at = pending.back();
      pending.pop_back();
      const auto& children = provenance.relations.children[at];
      pending.insert(pending.end(), children.rbegin(), children.rend());
      for (const Config& config : provenance.model.behaviours[at].configs) {
        (config.port == port_ ? here : anywhere).push_back({&config.source, at});
      }
    }
    result.across_ports = here.empty();
    for (const Voice& voice : result.across_ports ? anywhere : here) {
      if (is_active_(*voice.source)) {
        result.active.push_back(voice);
      } else {
        result.inactive.insert(*voice.source);
      }
    }
    return result;
  }

  // By a rule of any port.
  bool is_read(const std::string& source) {
    if (!read_) {
      read_.emplace();
      std::set<const Expression*> seen;
      for (const PortRules& port : rules_.ports) {
        for (const ConnectionRule& rule : port.rules) add_sources_of(*rule.condition, *read_, seen);
      }
    }
    return read_->count(source) != 0;
  }

  void add_senses(PortExplanation& result) const {
    std::set<std::string> sources;
    std::set<const Expression*> seen;
    for (const ConnectionRule& rule : arbiter_->rules) {
      add_sources_of(*rule.condition, sources, seen);
    }
    for (const ConnectionRule& rule : arbiter_->rules) sources.erase(rule.source);
    for (const Connection& other : rules_.other_connections) {
      if (other.port == port_) sources.erase(other.source);
    }
    result.senses.assign(sources.begin(), sources.end());
  }

  const RuleSet& rules_;
  const std::string& port_;
  const IsActive& is_active_;
  QuantifierExpansion expansion_;
  std::unordered_map<std::string, std::vector<ConfigPlace>> configs_;  // by source
  std::unordered_map<std::string, const Select*> selects_;             // by source
  std::unordered_map<std::size_t, Voices> voices_;                     // by behaviour
  std::optional<std::set<std::string>> read_;                          // by any rule
  const PortRules* arbiter_ = nullptr;      // none: the port is not arbitrated
  const ConnectionRule* winner_ = nullptr;  // none: it is idle
  const std::string* own_ = nullptr;        // source of the connection whose parts are looked at
  bool is_own_active_ = false;
};

}  // namespace

std::optional<std::vector<Literal>> ConnectionExplanation::reason() const {
  if (wins) return std::nullopt;
  if (!has_rule) return std::vector<Literal>{};
  if (!is_active) return std::vector<Literal>{{source, false}};
  if (holds) return earlier_because;
  // It is active and does not hold, so each part has a cause.
  std::map<std::string, bool> joined;
  for (const Part& part : parts) {
    const auto least = std::min_element(part.causes.begin(), part.causes.end(),
                                        [](const Cause& left, const Cause& right) {
                                          return left.because.size() < right.because.size();
                                        });
    for (const Literal& literal : least->because) joined[literal.source] = literal.active;
  }
  std::vector<Literal> result;
  result.reserve(joined.size());
  for (const auto& [name, active] : joined) result.push_back({name, active});
  return result;
}

PortExplanation Explainer::explain(const std::string& port, const IsActive& is_active) const {
  return PortInquiry(rules_, port, is_active).explain_all();
}

std::optional<ConnectionExplanation> Explainer::explain_connection(
    const std::string& port, const std::string& source, const IsActive& is_active) const {
  return PortInquiry(rules_, port, is_active).explain(source);
}

std::vector<std::string> Explainer::ports() const {
  std::set<std::string> names;
  for (const PortRules& port : rules_.ports) names.insert(port.port);
  for (const Connection& connection : rules_.other_connections) names.insert(connection.port);
  return {names.begin(), names.end()};
}

Location Explainer::place_of_timeout(const std::string& source) const {
  return rules_.provenance == nullptr ? Location()
                                      : rules::place_of_timeout(rules_.provenance->model, source);
}

std::string describe(const Element& element) {
  return (element.is_meta ? "meta-behaviour \"" : "behaviour \"") + element.name + '"';
}

}  // namespace arbiter::rules
