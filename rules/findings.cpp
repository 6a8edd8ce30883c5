#include "rules/findings.hpp"

#include <algorithm>
#include <map>
#include <optional>
#include <string>
#include <unordered_map>
#include <utility>
#include <vector>

#include "rules/names.hpp"
#include "rules/proof.hpp"
#include "rules/winners.hpp"

namespace arbiter::rules {
namespace {

// More causes than these are not counted, and more than those not told, at one port.
constexpr std::size_t kMaxCauses = 16;
constexpr std::size_t kMaxCausesTold = 8;
// Chains reported for one port; there may be as many as cubes of sources.
constexpr std::size_t kMaxChains = 4;

// The states of one port in which somebody wants to win and nobody does.
class PortFindings {
 public:
  PortFindings(const PortRules& rules, const CompiledPort& port, Diagnostics& diagnostics)
      : rules_(rules), port_(port), diagnostics_(diagnostics) {}

  // Throws DiagramLimit; what has been found until then holds.
  void find(Budget& budget) {
    SourceOrder order;
    order.add(port_);
    Winners winners(budget, order, false);
    winners_ = &winners;
    const Forget forget{*this};
    for (const auto& rule : port_.rules) {
      Diagram wins = winners.winner(rule);
      if (wins.is_false()) continue;
      candidates_.push_back({&rule, std::move(wins)});
    }
    find_states();
    if (!nobody_.is_false()) {
      note_states();
      note_chains();
    }
  }

 private:
  struct Candidate {
    const CompiledRule* rule;
    Diagram wins;
  };
  using Candidates = VariableSet;  // by their place in candidates_, as bits
  struct Forget {                  // diagrams must not outlive their builder
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

  // What is found before a bound is met is told.
  void note_states() {
    std::vector<Witness> causes;
    try {
      note_causes(causes, find_causes(causes));
    } catch (const DiagramLimit&) {
      if (!causes.empty()) note_causes(causes, false);
      throw;
    }
  }

  // A cause is a shortest conjunction that the causes before it leave uncovered. True: those are
  // all.
  bool find_causes(std::vector<Witness>& causes) {
    Diagram rest = nobody_;
    while (!rest.is_false() && causes.size() < kMaxCauses) {
      Witness next = winners_->witness(rest);
      if (!causes.empty()) next = shortened(std::move(next));
      rest = winners_->combine(Connective::kAndNot, rest, states_of(next));
      causes.push_back(std::move(next));
    }
    return rest.is_false();
  }

  void note_causes(const std::vector<Witness>& causes, bool are_all) {
    const Witness& witness = causes.front();
    const auto losers = active_candidates(witness);
    std::string message = "with " + in_words(witness) + ", nobody wins at " + port_.port +
                          " although " + enumerate(losers) + (losers.size() == 1 ? " is" : " are") +
                          " connected there and active";
    const std::size_t told = std::min(causes.size(), kMaxCausesTold);
    if (causes.size() > 1 || !are_all) {
      message += " (one of " + std::string(are_all ? "" : "more than ") +
                 std::to_string(causes.size()) + " such causes" +
                 (told < causes.size() ? ", of which " + std::to_string(told) + " are told" : "") +
                 ")";
    }
    diagnostics_.note("nobody-wins", where_of(losers.empty() ? "" : losers.front()),
                      message +
                          "; if somebody should win then, connect it in a behaviour that "
                          "nothing keeps from running in this state",
                      witness,
                      {causes.begin() + 1, causes.begin() + static_cast<std::ptrdiff_t>(told)});
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
    index_inhibitions();
    std::size_t chains = 0;
    for (std::size_t y = 0; y < candidates_.size(); ++y) {
      const auto& reads = candidates_[y].rule->reads;
      std::optional<Diagram> with_y;
      for (const auto& z : reads) {
        if (chains == kMaxChains) return;
        const Candidates silenced = may_be_silenced(y, z);
        if (silenced.none()) continue;
        if (!with_y) {
          const auto& source = candidates_[y].rule->source;
          with_y = winners_->combine(Connective::kAnd, nobody_, winners_->active(source));
        }
        chains += note_chain(candidates_[y], z, *with_y, silenced) ? 1 : 0;
      }
    }
  }

  void index_inhibitions() {
    for (std::size_t x = 0; x < candidates_.size(); ++x) {
      const auto& rule = *candidates_[x].rule;
      place_of_[rule.source].set(x);
      for (const auto& read : rule.reads) readers_of_[read].set(x);
      const auto implied = implied_literals(winners_->nodes(candidates_[x].wins));
      for (std::size_t i = 0; i < winners_->sources().size(); ++i) {
        if (implied.inactive[i]) inhibited_by_[winners_->sources()[i]].set(x);
      }
    }
  }

  // The x of chains x, y, z as far as single literals tell: x reads y, and neither do x or y
  // exclude each other's neighbour in the chain. Where all inhibit all, there would be cubes of
  // chains to look at, and none passes this.
  Candidates may_be_silenced(std::size_t y, const std::string& z) {
    const std::string& by = candidates_[y].rule->source;
    Candidates result = readers_of_[by] & ~inhibited_by_[z] & ~place_of_[z];
    result.reset(y);
    for (std::size_t x = 0; x < candidates_.size(); ++x) {
      if (result[x] && inhibited_by_[candidates_[x].rule->source][y]) result.reset(x);
    }
    return result;
  }

  bool note_chain(const Candidate& y, const std::string& z, const Diagram& with_y,
                  const Candidates& silenced) {
    const std::string& by = y.rule->source;
    Diagram blocked = winners_->combine(Connective::kAnd, with_y, winners_->active(z));
    blocked = winners_->combine(Connective::kAnd, blocked, winners_->given(y.wins, z, false));
    std::vector<std::string> names;
    std::optional<Witness> shortest;
    for (std::size_t i = 0; i < candidates_.size(); ++i) {
      if (blocked.is_false()) return false;
      if (!silenced[i]) continue;
      const Candidate* x = &candidates_[i];
      const Diagram states =
          winners_->combine(Connective::kAnd, blocked, winners_->given(x->wins, by, false));
      if (states.is_false()) continue;
      const Witness witness = winners_->witness(states);
      if (!shortest || size(witness) < size(*shortest)) shortest = witness;
      names.push_back(x->rule->source);
    }
    if (!shortest) return false;
    const std::string others = enumerate(names);
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
  std::unordered_map<std::string, Candidates> place_of_;      // by source: the candidate that it is
  std::unordered_map<std::string, Candidates> readers_of_;    // by source: whose rules read it
  std::unordered_map<std::string, Candidates> inhibited_by_;  // by source: that win only without it
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
                        source + " is connected to " + enumerate(losing.ports) +
                            ", and there is no state in which it wins anywhere" +
                            (losing.lacks_rule ? ", partly since no rule selects it" : "") +
                            "; give it a behaviour that can run, or remove its connections");
  }
}

// With all their names: whoever wants to know of one looks for it here.
void note_open(const std::vector<std::string>& ports, const std::string& limit,
               const Location& where, Diagnostics& diagnostics) {
  std::string names;
  for (const auto& port : ports) names += (names.empty() ? "" : ", ") + port;
  diagnostics.note("left-open", where,
                   "not all states in which nobody wins were looked at, at " +
                       std::to_string(ports.size()) + (ports.size() == 1 ? " port (" : " ports (") +
                       names + "): it takes " + limit +
                       "; the model is in order, this is only not known: --effort allows more");
}

}  // namespace

FindingsAccount find_more(const RuleSet& rules, const CompiledModel& model,
                          Diagnostics& diagnostics, Budget& budget) {
  warn_of_losers(rules, model, diagnostics);
  std::map<std::string, const CompiledPort*> compiled;
  for (const auto& port : model.ports) compiled.emplace(port.port, &port);
  struct Question {
    const PortRules* rules;
    const CompiledPort* port;
    Diagnostics found;
    std::string limit;  // why it is open
  };
  std::vector<Question> questions;
  for (const auto& port : rules.ports) {
    const auto found = compiled.find(port.port);
    if (found != compiled.end()) questions.push_back({&port, found->second, {}, {}});
  }
  const auto ask = [&](std::size_t i) {
    Question& question = questions[i];
    question.found = {};
    question.limit.clear();
    try {
      PortFindings(*question.rules, *question.port, question.found).find(budget);
    } catch (const DiagramLimit& limit) {
      question.limit = limit.what();
      if (dynamic_cast<const StepLimit*>(&limit) != nullptr) throw;
    }
  };
  share_out(
      budget, "looking for states in which nobody wins", questions.size(),
      [&](std::size_t i) { return questions[i].rules->port; }, ask);
  FindingsAccount account{questions.size(), 0};
  std::vector<std::string> open;
  std::string limit;
  Location where;
  for (Question& question : questions) {
    diagnostics.add(std::move(question.found));
    if (question.limit.empty()) continue;
    if (open.empty()) {
      limit = question.limit;
      where = question.rules->where;
    }
    open.push_back(question.rules->port);
  }
  account.open = open.size();
  if (!open.empty()) note_open(open, limit, where, diagnostics);
  return account;
}

}  // namespace arbiter::rules
