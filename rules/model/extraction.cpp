#include "rules/model/extraction.hpp"

#include <algorithm>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <unordered_map>
#include <utility>

#include "rules/model/quantifiers.hpp"
#include "rules/text/names.hpp"
#include "shm/limits.hpp"

namespace arbiter::rules {
namespace {

using SourceIndex = std::size_t;  // in RuleSet::sources
using PortIndex = std::size_t;    // in order of appearance

// The sources of the behaviours in x, or of x itself: what speaks for x.
struct Voice {
  std::unordered_map<PortIndex, std::vector<SourceIndex>> at;
  std::vector<SourceIndex> anywhere;
};

class Extraction {
 public:
  Extraction(const Model& model, const Hierarchy& hierarchy, Diagnostics& diagnostics)
      : model_(model),
        hierarchy_(hierarchy),
        diagnostics_(diagnostics),
        gives_advice_(!diagnostics.has_errors()) {
    rules_.sources = collect_sources(model);
    for (SourceIndex s = 0; s < rules_.sources.size(); ++s) {
      source_indices_.emplace(rules_.sources[s], s);
      const auto active = make_source(rules_.sources[s]);
      inactive_.push_back(make_operation(Operator::kNot, {active}));
    }
    last_rule_with_.resize(rules_.sources.size(), 0);
    voices_.resize(model.behaviours.size());
  }

  RuleSet extract() {
    if (model_.timeout) rules_.timeout = model_.timeout->value;
    for (const SourceDeclaration& source : model_.sources) {
      if (source.timeout) rules_.timeouts.emplace(source.name, *source.timeout);
    }
    expand_conditions();
    for (std::size_t b = 0; b < model_.behaviours.size(); ++b) {
      if (model_.behaviours[b].is_meta) {
        list_children(b);
      } else {
        extract_behaviour(b);
      }
    }
    for (const Select& select : model_.selects) extract_select(select);
    gather_ports();
    return std::move(rules_);
  }

 private:
  // All that is known of a connection's rule; what several behaviours ask for is its disjunction.
  struct Entry {
    std::size_t order;
    std::string port;
    ConnectionRule rule;
    std::vector<ExpressionPtr> alternatives;
  };

  void expand_conditions() {
    // A model with too many sources is refused: no quantifier of it is worth going through them.
    const std::vector<std::string> none;
    const bool is_refused = rules_.sources.size() > shm::kMaxSources;
    gives_advice_ = gives_advice_ && !is_refused;
    QuantifierExpansion expansion(is_refused ? none : rules_.sources);
    for (const Behaviour& behaviour : model_.behaviours) {
      auto& expanded = conditions_.emplace_back();
      std::size_t& terms = condition_terms_.emplace_back();
      for (const Condition& condition : behaviour.conditions) {
        expanded.push_back(expansion.expand(condition.expression));
        terms += terms_of(expanded.back());
        warn_of_unmatched(expansion);
      }
    }
    for (const Select& select : model_.selects) {
      select_conditions_.push_back(expansion.expand(select.condition));
      warn_of_unmatched(expansion);
    }
  }

  // What it shares counts at each place, for whoever looks at a rule goes through all of it.
  std::size_t terms_of(const ExpressionPtr& expression) {
    const bool is_shared = expression.use_count() > 1;
    if (is_shared) {
      const auto known = terms_of_shared_.find(expression.get());
      if (known != terms_of_shared_.end()) return known->second;
    }
    std::size_t terms = 1;
    for (const ExpressionPtr& operand : expression->operands) terms += terms_of(operand);
    if (is_shared) terms_of_shared_.emplace(expression.get(), terms);
    return terms;
  }

  void warn_of_unmatched(QuantifierExpansion& expansion) {
    for (const std::string& pattern : expansion.take_unmatched()) {
      if (!gives_advice_) continue;
      std::string similar;
      if (++unmatched_ <= kMaxSuggestions) {
        similar = similar_pattern(pattern, {rules_.sources.begin(), rules_.sources.end()});
      }
      diagnostics_.warning("matches-nothing", model_.patterns.at(pattern),
                           "no source that the model names matches " + quote(pattern) +
                               ": any() of it is false, all() and none() are true; " +
                               (similar.empty() ? "correct it, or name the source with <source>"
                                                : "did you mean " + quote(similar) + "?"));
    }
  }

  void list_children(std::size_t b) {
    MetaBehaviour meta{model_.behaviours[b].name, model_.behaviours[b].where, {}};
    for (const std::size_t child : hierarchy_.children(b)) {
      meta.children.push_back(model_.behaviours[child].name);
    }
    rules_.meta_behaviours.push_back(std::move(meta));
  }

  void extract_behaviour(std::size_t b) {
    const Behaviour& behaviour = model_.behaviours[b];
    BehaviourRules extracted{behaviour.name, behaviour.where, {}};
    std::set<std::pair<std::string, std::string>> seen;
    for (const Config& config : behaviour.configs) {
      if (!seen.emplace(config.source, config.port).second) {
        if (gives_advice_) {
          diagnostics_.warning(
              "duplicate-config", config.where,
              quote(behaviour.name) + " configures the connection from " + config.source + " to " +
                  config.port + " already; remove one of the two",
              {.ports = {config.port}, .source = config.source, .behaviour = behaviour.name});
        }
        continue;
      }
      const ConnectionRule rule{config.source, make_condition(b, index_port(config.port)),
                                config.where, behaviour.name};
      if (rule.condition == nullptr) return;
      add(config.order, config.port, rule);
      extracted.rules.emplace_back(config.port, rule);
    }
    rules_.behaviours.push_back(std::move(extracted));
  }

  // Parts 2 and 3 of a rule: the conditions of the behaviour and of all above it, and that nothing
  // is active which inhibits one of these. A null pointer where the limit is exceeded.
  ExpressionPtr make_condition(std::size_t behaviour, PortIndex port) {
    ++rule_count_;
    std::vector<ExpressionPtr> terms;
    for (std::size_t b = behaviour; b != Hierarchy::kNobody; b = hierarchy_.parent(b)) {
      terms.insert(terms.end(), conditions_[b].begin(), conditions_[b].end());
      if (!take_account_of(condition_terms_[b] + 1, model_.behaviours[behaviour].where)) {
        return nullptr;
      }
    }
    for (std::size_t b = behaviour; b != Hierarchy::kNobody; b = hierarchy_.parent(b)) {
      for (const Hierarchy::Inhibitor& inhibitor : hierarchy_.inhibitors(b)) {
        const auto& sources = find_inhibiting_sources(inhibitor, b, port);
        if (!take_account_of(sources.size() + 1, model_.behaviours[behaviour].where)) {
          return nullptr;
        }
        for (const SourceIndex source : sources) {
          if (std::exchange(last_rule_with_[source], rule_count_) == rule_count_) continue;
          terms.push_back(inactive_[source]);
        }
      }
    }
    if (terms.empty()) return always_;
    return terms.size() == 1 ? terms.front() : make_operation(Operator::kAnd, std::move(terms));
  }

  // It is about no behaviour, but about all rules: those from here on are missing.
  bool take_account_of(std::size_t terms, const Location& where) {
    term_count_ += terms;
    if (term_count_ <= kMaxRuleTerms) return true;
    if (std::exchange(is_exhausted_, true)) return false;
    gives_advice_ = false;
    diagnostics_.error("limit-exceeded", where,
                       "from here on, the rules of the model have more terms than the limit of " +
                           std::to_string(kMaxRuleTerms) +
                           " in all; use fewer inhibitions, or shorter conditions");
    return false;
  }

  // Those at the port, or, where there are none, all: an inhibition that would silently do nothing
  // is worse than one that holds.
  const std::vector<SourceIndex>& find_inhibiting_sources(const Hierarchy::Inhibitor& inhibitor,
                                                          std::size_t inhibited, PortIndex port) {
    const Voice& voice = find_voice(inhibitor.behaviour);
    const auto found = voice.at.find(port);
    if (found != voice.at.end()) return found->second;
    const Behaviour& behaviour = model_.behaviours[inhibitor.behaviour];
    const Mention& mention = behaviour.inhibitions[inhibitor.mention];
    if (gives_advice_ && !voice.anywhere.empty() && noted_.emplace(&mention, port).second) {
      diagnostics_.note("inhibition-across-ports", mention.where,
                        quote(behaviour.name) + " inhibits " +
                            quote(model_.behaviours[inhibited].name) + " at " + *port_names_[port] +
                            " without a connection there; it does so while " + describe(voice) +
                            " active, which is fine if you intend it",
                        {.ports = {*port_names_[port]}, .behaviour = behaviour.name});
    }
    return voice.anywhere;
  }

  [[nodiscard]] std::string describe(const Voice& voice) const {
    constexpr std::size_t kMaxNamed = 4;
    std::string result;
    for (std::size_t i = 0; i < std::min(voice.anywhere.size(), kMaxNamed); ++i) {
      if (i > 0) result += " or ";
      result += rules_.sources[voice.anywhere[i]];
    }
    if (voice.anywhere.size() > kMaxNamed) result += " or another of its sources";
    return result + " is";
  }

  const Voice& find_voice(std::size_t behaviour) {
    auto& voice = voices_[behaviour];
    if (voice) return *voice;
    voice.emplace();
    std::vector<std::size_t> pending{behaviour};
    while (!pending.empty() && term_count_ <= kMaxRuleTerms) {
      const std::size_t at = pending.back();
      pending.pop_back();
      const auto& children = hierarchy_.children(at);
      pending.insert(pending.end(), children.rbegin(), children.rend());
      term_count_ += 1 + model_.behaviours[at].configs.size();
      for (const Config& config : model_.behaviours[at].configs) {
        const SourceIndex source = source_indices_.at(config.source);
        voice->at[index_port(config.port)].push_back(source);
        voice->anywhere.push_back(source);
      }
    }
    for (auto& [port, sources] : voice->at) make_unique(sources);
    make_unique(voice->anywhere);
    return *voice;
  }

  static void make_unique(std::vector<SourceIndex>& sources) {
    std::sort(sources.begin(), sources.end());
    sources.erase(std::unique(sources.begin(), sources.end()), sources.end());
  }

  PortIndex index_port(const std::string& name) {
    const auto [found, is_new] = port_indices_.try_emplace(name, port_names_.size());
    if (is_new) port_names_.push_back(&found->first);
    return found->second;
  }

  void extract_select(const Select& select) {
    const auto index = static_cast<std::size_t>(&select - model_.selects.data());
    if (!take_account_of(terms_of(select_conditions_[index]), select.where)) return;
    const auto [found, is_new] = find_entry(select.source, select.port);
    if (is_new) {
      add(select.order, select.port, {select.source, select_conditions_[index], select.where, {}});
      return;
    }
    const ConnectionRule& first = entries_[found].rule;
    const std::string connection = "the connection from " + select.source + " to " + select.port;
    if (first.behaviour.empty()) {
      diagnostics_.error("duplicate-select", select.where,
                         connection + " has a rule already, at " + rules::describe(first.where) +
                             "; join the two with 'or', or remove one",
                         {.ports = {select.port}, .source = select.source});
    } else {
      diagnostics_.error(
          "rule-from-both", select.where,
          connection + " has a rule from the behaviour " + quote(first.behaviour) +
              " already, at " + rules::describe(first.where) +
              "; keep either this <select> or that <config>",
          {.ports = {select.port}, .source = select.source, .behaviour = first.behaviour});
    }
  }

  // The entry's index, or the one that it would get.
  std::pair<std::size_t, bool> find_entry(const std::string& source, const std::string& port) {
    const auto found = entry_indices_.find({source_indices_.at(source), index_port(port)});
    return found == entry_indices_.end() ? std::pair(entries_.size(), true)
                                         : std::pair(found->second, false);
  }

  void add(std::size_t order, const std::string& port, const ConnectionRule& rule) {
    const auto [found, is_new] = find_entry(rule.source, port);
    if (is_new) {
      entry_indices_.emplace(std::pair(source_indices_.at(rule.source), index_port(port)), found);
      entries_.push_back({order, port, rule, {}});
    }
    entries_[found].alternatives.push_back(rule.condition);
  }

  void gather_ports() {
    std::sort(entries_.begin(), entries_.end(),
              [](const Entry& a, const Entry& b) { return a.order < b.order; });
    std::map<std::string, PortRules> ports;
    for (Entry& entry : entries_) {
      PortRules& port = ports[entry.port];
      if (port.rules.empty()) port.where = entry.rule.where;
      if (entry.alternatives.size() > 1) {
        entry.rule.condition = make_operation(Operator::kOr, std::move(entry.alternatives));
      }
      port.rules.push_back(std::move(entry.rule));
    }
    std::set<std::string> placed;
    for (const Arbiter& arbiter : model_.arbiters) {
      const auto port = ports.find(arbiter.port);
      if (port != ports.end()) {
        if (placed.insert(arbiter.port).second) port->second.where = arbiter.where;
        port->second.first_wins = port->second.first_wins || arbiter.first_wins;
      } else if (!arbiter.is_incomplete && gives_advice_) {
        diagnostics_.warning("no-rule-at-port", arbiter.where,
                             "no rule selects a connection at " + arbiter.port +
                                 ", so that it is not arbitrated; write a <select> or a <config> "
                                 "for it, or remove this",
                             {.ports = {arbiter.port}});
      }
    }
    for (auto& [name, port] : ports) {
      port.port = name;
      rules_.ports.push_back(std::move(port));
    }
  }

  const Model& model_;
  const Hierarchy& hierarchy_;
  Diagnostics& diagnostics_;
  bool gives_advice_;
  std::size_t unmatched_ = 0;  // patterns
  RuleSet rules_;

  std::unordered_map<std::string, SourceIndex> source_indices_;
  std::unordered_map<std::string, PortIndex> port_indices_;
  std::vector<const std::string*> port_names_;
  std::vector<std::vector<ExpressionPtr>> conditions_;  // by behaviour, quantifiers expanded
  std::vector<std::size_t> condition_terms_;            // by behaviour, of all of these
  std::vector<ExpressionPtr> select_conditions_;
  std::unordered_map<const Expression*, std::size_t> terms_of_shared_;
  std::vector<ExpressionPtr> inactive_;  // by source, shared by all rules
  const ExpressionPtr always_ = make_constant(true);
  std::vector<std::optional<Voice>> voices_;  // by behaviour, made when needed

  std::vector<Entry> entries_;
  std::map<std::pair<SourceIndex, PortIndex>, std::size_t> entry_indices_;
  std::size_t rule_count_ = 0;
  std::vector<std::size_t> last_rule_with_;  // by source: the last rule that has it as a term
  std::size_t term_count_ = 0;
  bool is_exhausted_ = false;
  std::set<std::pair<const Mention*, PortIndex>> noted_;
};

}  // namespace

RuleSet extract_rules(const Model& model, const Hierarchy& hierarchy, Diagnostics& diagnostics) {
  return Extraction(model, hierarchy, diagnostics).extract();
}

}  // namespace arbiter::rules
