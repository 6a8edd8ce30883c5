#include "rules/findings.hpp"

#include <algorithm>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "rules/names.hpp"
#include "rules/winners.hpp"

namespace arbiter::rules {
namespace {

// More causes than these are not counted.
constexpr std::size_t kMaxCauses = 16;
// Chains reported for one port; there may be as many as cubes of sources.
constexpr std::size_t kMaxChains = 4;

std::string joined(const std::vector<std::string>& names, std::string_view last) {
  constexpr std::size_t kMaxNames = 6;  // that a sentence spells out
  std::string text;
  for (std::size_t i = 0; i < names.size(); ++i) {
    if (i == kMaxNames) return text + " and " + std::to_string(names.size() - i) + " more";
    if (i > 0) text += i + 1 == names.size() ? std::string(last) : std::string(", ");
    text += names[i];
  }
  return text;
}

// The states of one port in which somebody wants to win and nobody does.
class PortFindings {
 public:
  PortFindings(const PortRules& rules, const CompiledPort& port, Diagnostics& diagnostics)
      : rules_(rules), port_(port), diagnostics_(diagnostics) {}

  // Returns the work that it took. Throws DiagramLimit.
  std::uint64_t find(std::uint64_t max_work) {
    SourceOrder order;
    order.add(port_);
    Winners winners(order, max_work);
    winners_ = &winners;
    const Forget forget{*this};
    for (const auto& rule : port_.rules) {
      Diagram wins = winners.winner(rule);
      if (!wins.is_false()) candidates_.push_back({&rule, std::move(wins)});
    }
    find_states();
    if (!nobody_.is_false()) {
      note_states();
      note_chains();
    }
    return winners.work();
  }

 private:
  struct Candidate {
    const CompiledRule* rule;
    Diagram wins;
  };
  struct Forget {  // diagrams must not outlive their builder
    PortFindings& findings;
    ~Forget() {
      findings.candidates_.clear();
      findings.nobody_ = {};
      findings.winners_ = nullptr;
    }
  };

  // nobody_: some candidate is active, and none wins.
  void find_states() {
    nobody_ = winners_->constant(false);
    for (const auto& each : candidates_) {
      nobody_ = winners_->combine(Connective::kOr, winners_->active(each.rule->source), nobody_);
    }
    for (const auto& each : candidates_) {
      nobody_ = winners_->combine(Connective::kAndNot, nobody_, each.wins);
    }
  }

  [[nodiscard]] Location where_of(const std::string& source) const {
    for (const auto& rule : rules_.rules) {
      if (rule.source == source) return rule.where;
    }
    return rules_.where;
  }

  // A cause is a shortest conjunction that the causes before it leave uncovered.
  void note_states() {
    const Witness witness = winners_->witness(nobody_);
    std::size_t causes = 1;
    Diagram rest = winners_->combine(Connective::kAndNot, nobody_, states_of(witness));
    while (!rest.is_false() && causes < kMaxCauses) {
      ++causes;
      const Witness next = shortened(winners_->witness(rest));
      rest = winners_->combine(Connective::kAndNot, rest, states_of(next));
    }
    const auto losers = active_candidates(witness);
    std::string message = "with " + in_words(witness) + ", nobody wins at " + port_.port +
                          " although " + joined(losers, " and ") +
                          (losers.size() == 1 ? " is" : " are") + " connected there and active";
    if (causes > 1) {
      message += " (one of " + std::string(rest.is_false() ? "" : "more than ") +
                 std::to_string(causes) + " such causes)";
    }
    diagnostics_.note("nobody-wins", where_of(losers.empty() ? "" : losers.front()),
                      message +
                          "; if somebody should win then, connect it in a behaviour that "
                          "nothing keeps from running in this state",
                      witness);
  }

  std::vector<std::string> active_candidates(const Witness& witness) const {
    std::vector<std::string> result;
    for (const auto& name : witness.active) {
      const auto is_it = [&](const Candidate& each) { return each.rule->source == name; };
      if (std::any_of(candidates_.begin(), candidates_.end(), is_it)) result.push_back(name);
    }
    return result;
  }

  Diagram states_of(const Witness& witness) {
    Diagram states = winners_->constant(true);
    for (const auto& name : witness.active) {
      states = winners_->combine(Connective::kAnd, states, winners_->active(name));
    }
    for (const auto& name : witness.inactive) {
      states = winners_->combine(Connective::kAndNot, states, winners_->active(name));
    }
    return states;
  }

  // What implies a part of nobody_ may imply all of it with fewer literals.
  Witness shortened(Witness witness) {
    for (auto* side : {&witness.active, &witness.inactive}) {
      for (std::size_t i = side->size(); i-- > 0;) {
        const std::string name = (*side)[i];
        side->erase(side->begin() + static_cast<std::ptrdiff_t>(i));
        if (winners_->combine(Connective::kAndNot, states_of(witness), nobody_).is_false())
          continue;
        side->insert(side->begin() + static_cast<std::ptrdiff_t>(i), name);
      }
    }
    return witness;
  }

  // x is silenced by y, which is silenced by z: all three are active, nobody wins, x would win if
  // y alone were inactive, and y would win if z alone were. Those that share y and z make one
  // finding.
  void note_chains() {
    std::size_t chains = 0;
    for (const auto& y : candidates_) {
      const std::string& by = y.rule->source;
      const Diagram with_y = winners_->combine(Connective::kAnd, nobody_, winners_->active(by));
      if (with_y.is_false()) continue;
      const auto silenced = silenced_by(y, with_y);
      if (silenced.empty()) continue;
      for (const auto& z : y.rule->reads) {
        if (chains == kMaxChains) return;
        chains += note_chain(y, z, with_y, silenced) ? 1 : 0;
      }
    }
  }

  struct Silenced {
    const CompiledRule* rule;
    Diagram states;
  };

  std::vector<Silenced> silenced_by(const Candidate& y, const Diagram& with_y) {
    std::vector<Silenced> result;
    for (const auto& x : candidates_) {
      const auto& reads = x.rule->reads;
      const std::string& by = y.rule->source;
      if (&x == &y || std::find(reads.begin(), reads.end(), by) == reads.end()) continue;
      const Diagram otherwise = winners_->given(x.wins, by, false);
      Diagram states = winners_->combine(Connective::kAnd, with_y, otherwise);
      if (!states.is_false()) result.push_back({x.rule, std::move(states)});
    }
    return result;
  }

  bool note_chain(const Candidate& y, const std::string& z, const Diagram& with_y,
                  const std::vector<Silenced>& silenced) {
    if (z == y.rule->source) return false;
    Diagram blocked = winners_->combine(Connective::kAnd, with_y, winners_->active(z));
    blocked = winners_->combine(Connective::kAnd, blocked, winners_->given(y.wins, z, false));
    if (blocked.is_false()) return false;
    std::vector<std::string> names;
    std::optional<Witness> shortest;
    for (const auto& x : silenced) {
      if (x.rule->source == z) continue;
      const Diagram states = winners_->combine(Connective::kAnd, x.states, blocked);
      if (states.is_false()) continue;
      const Witness witness = winners_->witness(states);
      if (!shortest || size(witness) < size(*shortest)) shortest = witness;
      names.push_back(x.rule->source);
    }
    if (!shortest) return false;
    const std::string& by = y.rule->source;
    const std::string others = joined(names, " and ");
    diagnostics_.note("starved", where_of(by),
                      "at " + port_.port + ", " + by + " silences " + others + " even while " + z +
                          " silences " + by + ": with " + in_words(*shortest) +
                          ", nobody wins; if " + names.front() +
                          " should win then, let no inhibition but its condition \"not " + by +
                          " or " + z + "\" keep it out",
                      *shortest);
    return true;
  }

  static std::size_t size(const Witness& witness) {
    return witness.active.size() + witness.inactive.size();
  }

  const PortRules& rules_;
  const CompiledPort& port_;
  Diagnostics& diagnostics_;
  Winners* winners_ = nullptr;
  std::vector<Candidate> candidates_;  // connections that can win
  Diagram nobody_;
};

// Sources that are connected to arbitrated ports only, and win at none of them. Where it is one
// connection with a rule, compile() has said so.
void warn_of_losers(const RuleSet& rules, const CompiledModel& model, Diagnostics& diagnostics) {
  struct Losing {
    std::vector<std::string> ports;
    bool wins = false;
    bool lacks_rule = false;
    Location where;
  };
  std::map<std::string, Losing> sources;
  std::map<std::string, const PortRules*> by_name;
  for (const auto& port : rules.ports) by_name.emplace(port.port, &port);
  for (const auto& port : model.ports) {
    const auto found = by_name.find(port.port);
    for (const auto& rule : port.rules) {
      Losing& source = sources[rule.source];
      source.wins = source.wins || rule.kind != shm::table::kNever;
      source.ports.push_back(port.port);
      if (found == by_name.end() || rule.kind != shm::table::kNever) continue;
      const auto& written = found->second->rules;
      const auto own = std::find_if(written.begin(), written.end(),
                                    [&](const auto& each) { return each.source == rule.source; });
      source.lacks_rule = source.lacks_rule || own == written.end();
      source.where = own == written.end() ? found->second->where : own->where;
    }
  }
  for (const auto& [source, losing] : sources) {
    if (losing.wins || (losing.ports.size() == 1 && !losing.lacks_rule)) continue;
    diagnostics.warning("never-wins", losing.where,
                        source + " is connected to " + joined(losing.ports, " and ") +
                            ", and there is no state in which it wins anywhere" +
                            (losing.lacks_rule ? ", partly since no rule selects it" : "") +
                            "; give it a behaviour that can run, or remove its connections");
  }
}

}  // namespace

FindingsAccount find_more(const RuleSet& rules, const CompiledModel& model,
                          Diagnostics& diagnostics, std::uint64_t max_work) {
  warn_of_losers(rules, model, diagnostics);
  FindingsAccount account;
  std::map<std::string, const CompiledPort*> compiled;
  for (const auto& port : model.ports) compiled.emplace(port.port, &port);
  for (const auto& port : rules.ports) {
    const auto found = compiled.find(port.port);
    if (found == compiled.end()) continue;
    ++account.ports;
    const std::uint64_t room = std::min(kMaxPortWork, max_work - std::min(max_work, account.work));
    std::string limit = "the model's other ports have used up all steps";
    if (room > 0) {
      try {
        account.work += PortFindings(port, *found->second, diagnostics).find(room);
        continue;
      } catch (const DiagramLimit& reached) {
        account.work += room;
        limit = std::string("it takes ") + reached.what();
      }
    }
    if (account.open++ > 0) continue;  // one note tells enough
    diagnostics.note("left-open", port.where,
                     "whether there are states in which nobody wins at " + port.port +
                         ", or where else, was not found out: " + limit +
                         "; the model is in order, this is only not known");
  }
  return account;
}

}  // namespace arbiter::rules
