#include "rules/ask/nobody_wins.hpp"

#include <algorithm>
#include <optional>
#include <string>
#include <unordered_map>
#include <utility>
#include <vector>

#include "rules/ask/inhibition_circle.hpp"
#include "rules/prove/proof.hpp"
#include "rules/prove/winners.hpp"
#include "rules/text/names.hpp"

namespace arbiter::rules {
namespace {

// More causes than these are not counted, and more than those not told, at one port.
constexpr std::size_t kMaxCauses = 16;
constexpr std::size_t kMaxCausesTold = 8;
// Chains reported for one port; there may be as many as cubes of sources.
constexpr std::size_t kMaxChains = 4;

class PortFindings {
 public:
  PortFindings(const PortRules& rules, const CompiledPort& port, const ProvedStatements& statements,
               Diagnostics& diagnostics)
      : rules_(rules), port_(port), statements_(statements), diagnostics_(diagnostics) {}

  void find(Budget& budget) {
    SourceOrder order;
    order.add(port_);
    add_sources(statements_, order);
    Winners winners(budget, order, false);
    winners_ = &winners;
    const Forget forget{*this};
    for (const auto& rule : port_.rules) {
      // Whether somebody wins does not depend on who comes first.
      Diagram wins = winners.holds(rule);
      if (wins.is_false()) continue;
      candidates_.push_back({&rule, std::move(wins)});
    }
    index_inhibitions();
    if (statements_.empty()) warn_of_circle(budget);  // it needs no states, which may be too large
    find_states();
    leave_out_stated();
    if (!nobody_.is_false()) {
      note_states();
      if (!statements_.empty()) warn_of_circle(budget);  // behind them: it may outgrow a bound
      if (port_.in_order) throw DiagramLimit("a diagram of each winner, and those are too large");
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

  // Of these states, those remain in which some active candidate could win and no statement would
  // be false. In the others it is stated, in other words, that nobody wins.
  void leave_out_stated() {
    if (statements_.empty()) return;
    Diagram unstated = winners_->constant(false);
    for (const auto& each : candidates_) {
      const Diagram active = winners_->active(each.rule->source);
      Diagram states = winners_->combine(Connective::kAnd, nobody_, active);
      for (const auto& statement : statements_) {
        if (states.is_false()) break;
        states = allowed_by(*statement, *winners_, port_, *each.rule, states);
      }
      unstated = winners_->combine(Connective::kOr, unstated, states);
    }
    nobody_ = unstated;
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

  // A cause is a shortest of the conjunctions that cover a state which the causes before it do not.
  // True: those are all.
  bool find_causes(std::vector<Witness>& causes) {
    Diagram rest = nobody_;
    while (!rest.is_false() && causes.size() < kMaxCauses) {
      Witness next = winners_->witness(nobody_, rest);
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
      message +=
          " (one of " + std::string(are_all ? "" : "more than ") + std::to_string(causes.size()) +
          " such causes" +
          (told < causes.size() ? ", of which " + std::to_string(told) + " are listed" : "") + ")";
    }
    diagnostics_.note("nobody-wins", where_of(losers.empty() ? "" : losers.front()),
                      message +
                          "; if somebody should win then, connect it in a behaviour that "
                          "nothing keeps from running in this state",
                      {.ports = {port_.port}, .source = losers.empty() ? "" : losers.front()},
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

  // Each of them wins only while the next one is inactive, the last while the first is. With all of
  // them active, and nobody else, nobody wins, which nobody means who gives priorities. One for a
  // port. A circle of which a statement says that nobody wins is passed over.
  void warn_of_circle(Budget& budget) {
    std::vector<Candidates> keeps_out;
    for (const Candidate& each : candidates_) keeps_out.push_back(inhibited_by_[each.rule->source]);
    const Circle circle = find_circle(std::move(keeps_out), budget,
                                      [&](const Circle& tried) { return is_stated(tried); });
    if (!circle.empty()) warn_of(circle);
  }

  bool is_stated(const Circle& circle) {
    if (statements_.empty()) return false;
    Diagram states = nobody_;
    for (std::size_t i = 0; i < candidates_.size(); ++i) {
      const bool is_of_it = std::find(circle.begin(), circle.end(), i) != circle.end();
      states = winners_->combine(is_of_it ? Connective::kAnd : Connective::kAndNot, states,
                                 winners_->active(candidates_[i].rule->source));
    }
    return states.is_false();
  }

  void warn_of(const Circle& circle) {
    std::vector<std::string> names(circle.size());
    std::transform(circle.begin(), circle.end(), names.begin(),
                   [&](std::size_t each) { return candidates_[each].rule->source; });
    std::string message = "at " + port_.port;
    for (std::size_t i = 0; i < names.size(); ++i) {
      message +=
          (i == 0 ? ", " : " and ") + names[i] + " is kept out by " + names[(i + 1) % names.size()];
    }
    message +=
        ", in a circle: while they are active, and nobody else that is connected there, nobody "
        "wins; let one of them win then, by an inhibition or a condition less, or if that is "
        "meant, say so in a statement (--assert)";
    diagnostics_.warning("inhibition-circle", where_of(names.front()), message,
                         {.ports = {port_.port}, .source = names.front()});
  }

  // x is silenced by y, which z keeps from winning: x and y are active, nobody wins, x would win if
  // y alone were inactive, and y would win if z alone were inactive, where z is active and silences
  // it, or active, where its condition lacks z. Those that share y and z make one finding.
  void note_chains() {
    std::size_t left = kMaxChains;
    for (const bool lacks_z : {false, true}) {
      for (std::size_t y = 0; y < candidates_.size(); ++y) left -= note_chains_of(y, lacks_z, left);
    }
  }

  // Those with this y, `most` of them. How many there are.
  std::size_t note_chains_of(std::size_t y, bool lacks_z, std::size_t most) {
    std::size_t noted = 0;
    std::optional<Diagram> with_y;
    for (const auto& z : candidates_[y].rule->reads) {
      if (noted == most) break;
      const Candidates silenced = may_be_silenced(y, z, lacks_z);
      if (silenced.none()) continue;
      if (!with_y) {
        const auto& source = candidates_[y].rule->source;
        with_y = winners_->combine(Connective::kAnd, nobody_, winners_->active(source));
      }
      noted += note_chain(candidates_[y], z, lacks_z, *with_y, silenced) ? 1 : 0;
    }
    return noted;
  }

  void index_inhibitions() {
    VariableNumbers own;  // of this port; statements may be about others, too
    for (std::size_t x = 0; x < candidates_.size(); ++x) {
      const auto& rule = *candidates_[x].rule;
      place_of_[rule.source].set(x);
      for (const auto& read : rule.reads) readers_of_[read].set(x);
      const auto implied = implied_literals(own.number(winners_->nodes(candidates_[x].wins)));
      for (std::size_t i = 0; i < own.variables().size(); ++i) {
        const auto variable = static_cast<std::size_t>(own.variables()[i]);
        if (implied.inactive[i]) inhibited_by_[winners_->sources()[variable]].set(x);
      }
    }
  }

  // The x of chains x, y, z as far as single literals tell: x reads y, and neither do x or y
  // exclude each other's neighbour in the chain. Where all inhibit all, there would be cubes of
  // chains to look at, and none passes this.
  Candidates may_be_silenced(std::size_t y, const std::string& z, bool lacks_z) {
    const std::string& by = candidates_[y].rule->source;
    Candidates result = readers_of_[by] & ~place_of_[z];
    if (!lacks_z) result &= ~inhibited_by_[z];
    result.reset(y);
    if (result.none()) return result;
    for (std::size_t x = 0; x < candidates_.size(); ++x) {
      if (result[x] && inhibited_by_[candidates_[x].rule->source][y]) result.reset(x);
    }
    return result;
  }

  bool note_chain(const Candidate& y, const std::string& z, bool lacks_z, const Diagram& with_y,
                  const Candidates& silenced) {
    const std::string& by = y.rule->source;
    Diagram blocked = winners_->combine(lacks_z ? Connective::kAndNot : Connective::kAnd, with_y,
                                        winners_->active(z));
    blocked = winners_->combine(Connective::kAnd, blocked, winners_->given(y.wins, z, lacks_z));
    std::vector<std::string> names;
    std::optional<Witness> shortest;
    std::string would_win;  // in it
    bool is_known = true;   // to be a shortest of all
    for (std::size_t i = 0; i < candidates_.size(); ++i) {
      if (blocked.is_false()) return false;
      if (!silenced[i]) continue;
      const Candidate* x = &candidates_[i];
      const Diagram states =
          winners_->combine(Connective::kAnd, blocked, winners_->given(x->wins, by, false));
      if (states.is_false()) continue;
      const Witness witness = winners_->witness(states);
      is_known = is_known && witness.is_shortest;
      if (!shortest || size(witness) < size(*shortest)) {
        shortest = witness;
        would_win = x->rule->source;
      }
      names.push_back(x->rule->source);
    }
    if (!shortest) return false;
    shortest->is_shortest = is_known;
    const std::string others = enumerate(names);
    // Not where it lets both win: where y wins by something else than z.
    const bool is_enough = winners_->given(y.wins, z, !lacks_z).is_false();
    const std::string condition = is_enough
                                      ? ": \"not " + by + (lacks_z ? " or not " : " or ") + z + '"'
                                      : " that fails only where " + by + " wins";
    diagnostics_.note("starved", where_of(by),
                      "at " + port_.port + ", " + by + " silences " + others + " even while " +
                          (lacks_z ? by + " cannot win for want of " + z : z + " silences " + by) +
                          ": with " + in_words(*shortest) + ", nobody wins; if " + would_win +
                          " should win then, replace what keeps it out, an inhibition or a part of "
                          "its condition, by a condition of its behaviour" +
                          condition,
                      {.ports = {port_.port}, .source = by}, *shortest);
    return true;
  }

  static std::size_t size(const Witness& witness) {
    return witness.active.size() + witness.inactive.size();
  }

  const PortRules& rules_;
  const CompiledPort& port_;
  const ProvedStatements& statements_;  // that speak of the port
  Diagnostics& diagnostics_;
  Winners* winners_ = nullptr;
  std::vector<Candidate> candidates_;  // connections that can win
  Diagram nobody_;
  std::unordered_map<std::string, Candidates> place_of_;      // by source: the candidate that it is
  std::unordered_map<std::string, Candidates> readers_of_;    // by source: whose rules read it
  std::unordered_map<std::string, Candidates> inhibited_by_;  // by source: that win only without it
};

}  // namespace

void find_where_nobody_wins(const PortRules& rules, const CompiledPort& port,
                            const ProvedStatements& statements, Diagnostics& diagnostics,
                            Budget& budget) {
  PortFindings(rules, port, statements, diagnostics).find(budget);
}

}  // namespace arbiter::rules
