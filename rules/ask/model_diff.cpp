#include "rules/ask/model_diff.hpp"

#include <algorithm>
#include <map>
#include <set>
#include <unordered_map>

#include "rules/prove/proof.hpp"
#include "rules/prove/state_count.hpp"
#include "rules/prove/state_search.hpp"
#include "rules/prove/winners.hpp"

namespace arbiter::rules {
namespace {

using PortDiff = ModelDiff::PortDiff;

const CompiledRule* find_rule(const CompiledPort& port, const std::string& source) {
  const auto found = std::find_if(port.rules.begin(), port.rules.end(),
                                  [&](const auto& rule) { return rule.source == source; });
  return found == port.rules.end() ? nullptr : &*found;
}

// Whether a connection obviously wins in the same states of both. Where rules are decided in order,
// those before it have a part in that.
bool wins_alike(const CompiledPort& a, const CompiledRule& of_a, const CompiledPort& b,
                const CompiledRule& of_b) {
  if (!a.in_order && !b.in_order) return of_a == of_b;
  return a.in_order && b.in_order &&
         std::equal(a.rules.data(), &of_a + 1, b.rules.data(), &of_b + 1);
}

// The states of one port that both models arbitrate.
//
// Connections whose function is the same in both are left out: the others of either model exclude
// it, so no state in which it wins is one of change. For the rest all is counted from pairs, since
// winners exclude each other: the states of {a, nobody} are those of a, less those of all {a, b}.
class PortComparison {
 public:
  PortComparison(const CompiledPort& before, const CompiledPort& after, PortDiff& result)
      : before_(before), after_(after), result_(result) {}

  // Throws StepLimit, and then the result is that the port is open.
  void compare(Budget& budget) {
    SourceOrder order;
    order.add(before_);
    order.add(after_);
    result_.sources = order.names().size();
    result_.of = to_decimal(power_of_two(result_.sources));
    gather_candidates();
    if (candidates_.empty()) return;
    try {
      const Budget::Part part(budget, steps_at_once(budget));
      Winners winners(budget, order);
      const Release release{*this};
      winners_ = &winners;
      budget_ = &budget;
      count_pairs();
      add_examples();
    } catch (const StepLimit& limit) {
      search(budget, limit.what());
      throw;
    } catch (const DiagramLimit& limit) {
      search(budget, limit.what());
    }
  }

 private:
  struct Side {
    const CompiledPort* port = nullptr;
    const CompiledRule* rule = nullptr;
    Diagram wins;
    StateCount states = 0;
    Literals implied;        // by `wins`; none where there are too many sources
    StateCount decided = 0;  // of these, in which some connection of the other model wins
  };
  struct Candidate {
    std::string source;
    Side before, after;
  };
  struct Found {
    const Candidate* before;  // null: nobody
    const Candidate* after;
    StateCount states;
  };

  // Rules are decided in order because their diagrams are too large: little hope for these here.
  // A part is left for the search.
  [[nodiscard]] std::uint64_t steps_at_once(const Budget& budget) const {
    constexpr std::uint64_t kMostInOrder = 500'000;
    const std::uint64_t most = budget.left() / 4 * 3;
    return before_.in_order || after_.in_order ? std::min(most, kMostInOrder) : most;
  }

  // State by state: one in which the winners differ, then one in which another pair of them does.
  void search(Budget& budget, const std::string& limit) {
    result_.changes.clear();
    result_.states = std::string(1, '0');
    const int max_steps = StateSearch::steps_within(budget.left());
    StateSearch search(max_steps);
    const auto before = search.winners(before_), after = search.winners(after_);
    search.require_any({-before.nobody, -after.nobody});
    for (std::size_t i = 0; i < before_.rules.size(); ++i) {
      const CompiledRule* twin = find_rule(after_, before_.rules[i].source);
      if (twin == nullptr) continue;
      const auto place = static_cast<std::size_t>(twin - after_.rules.data());
      search.require_any({-before.wins[i], -after.wins[place]});
    }
    auto answer = StateSearch::Answer::kOpen;
    while (result_.changes.size() < kMaxExamples) {
      answer = search.find({});
      if (answer != StateSearch::Answer::kYes) break;
      ModelDiff::Change change;
      const auto pair = search.all_of({winner_found(search, before, before_, change.before),
                                       winner_found(search, after, after_, change.after)});
      change.example = search.witness(pair);
      result_.changes.push_back(std::move(change));
      search.require_any({-pair});
    }
    budget.note(StateSearch::budget_of(max_steps - search.steps_left()));
    result_.is_complete = answer == StateSearch::Answer::kNo;
    result_.is_counted = result_.is_complete && result_.changes.empty();
    if (!result_.is_complete && result_.changes.empty()) result_.open = limit;
  }

  // That the one wins who does in the state that was found.
  static StateSearch::Proposition winner_found(const StateSearch& search,
                                               const StateSearch::Port& winners,
                                               const CompiledPort& port,
                                               std::optional<std::string>& name) {
    for (std::size_t i = 0; i < winners.wins.size(); ++i) {
      if (!search.is_so(winners.wins[i])) continue;
      name = port.rules[i].source;
      return winners.wins[i];
    }
    return winners.nobody;
  }

  void gather_candidates() {
    std::map<std::string, std::size_t> index;
    const auto add = [&](const CompiledPort& port, Side Candidate::*side,
                         const CompiledPort& other) {
      for (const auto& rule : port.rules) {
        const CompiledRule* twin = find_rule(other, rule.source);
        if (twin != nullptr && wins_alike(port, rule, other, *twin)) continue;
        const auto [found, is_new] = index.emplace(rule.source, candidates_.size());
        if (is_new) candidates_.push_back({rule.source, {}, {}});
        (candidates_[found->second].*side).port = &port;
        (candidates_[found->second].*side).rule = &rule;
      }
    };
    add(before_, &Candidate::before, after_);
    add(after_, &Candidate::after, before_);
  }

  StateCount count(const Diagram& function) {
    const DiagramNodes nodes = winners_->nodes(function);
    budget_->spend(nodes.nodes.size());
    return count_states(nodes, result_.sources);
  }

  void build(Side& side) {
    if (side.rule == nullptr) return;
    side.wins = winners_->winner(*side.port, *side.rule);
    if (result_.sources > VariableSet().size()) return;
    side.implied = implied_literals(winners_->nodes(side.wins));
  }

  void count_pairs() {
    for (auto& candidate : candidates_) {
      build(candidate.before);
      build(candidate.after);
    }
    std::erase_if(candidates_,
                  [](const auto& each) { return each.before.wins == each.after.wins; });
    for (auto& candidate : candidates_) {
      candidate.before.states = count(candidate.before.wins);
      candidate.after.states = count(candidate.after.wins);
    }
    for (auto& a : candidates_) {
      if (a.before.wins.is_false()) continue;
      for (auto& b : candidates_) {
        if (b.after.wins.is_false() || exclude_each_other(a.before.implied, b.after.implied)) {
          continue;
        }
        const Diagram both = winners_->combine(Connective::kAnd, a.before.wins, b.after.wins);
        if (both.is_false()) continue;
        const StateCount states = count(both);
        a.before.decided += states;
        b.after.decided += states;
        if (&a != &b) found_.push_back({&a, &b, states});
      }
    }
    for (const auto& each : candidates_) {
      const StateCount lost = each.before.states - each.before.decided;
      const StateCount won = each.after.states - each.after.decided;
      if (lost > 0) found_.push_back({&each, nullptr, lost});
      if (won > 0) found_.push_back({nullptr, &each, won});
    }
    std::stable_sort(found_.begin(), found_.end(), [](const auto& left, const auto& right) {
      return left.states > right.states;
    });
    StateCount all = 0;
    for (const Found& each : found_) all += each.states;
    result_.states = to_decimal(all);
  }

  void add_examples() {
    for (const Found& each : found_) {
      ModelDiff::Change change;
      if (each.before != nullptr) change.before = each.before->source;
      if (each.after != nullptr) change.after = each.after->source;
      change.states = to_decimal(each.states);
      result_.changes.push_back(std::move(change));
    }
    try {
      for (std::size_t i = 0; i < std::min(found_.size(), kMaxExamples); ++i) {
        result_.changes[i].example = winners_->witness(states_of(found_[i]));
      }
    } catch (const DiagramLimit&) {
      // The counts hold without: {a, nobody} is the only function that was not built for them.
    }
  }

  Diagram states_of(const Found& found) {
    if (found.before != nullptr && found.after != nullptr) {
      return winners_->combine(Connective::kAnd, found.before->before.wins,
                               found.after->after.wins);
    }
    Diagram states = found.before != nullptr ? found.before->before.wins : found.after->after.wins;
    for (const auto& other : candidates_) {
      const auto& rival = found.before != nullptr ? other.after.wins : other.before.wins;
      if (!rival.is_false()) states = winners_->combine(Connective::kAndNot, states, rival);
    }
    return states;
  }

  struct Release {  // diagrams must not outlive their builder
    PortComparison& comparison;
    ~Release() {
      comparison.candidates_.clear();
      comparison.found_.clear();
      comparison.winners_ = nullptr;
    }
  };

  static constexpr std::size_t kMaxExamples = 64;

  const CompiledPort& before_;
  const CompiledPort& after_;
  PortDiff& result_;
  Winners* winners_ = nullptr;
  Budget* budget_ = nullptr;
  std::vector<Candidate> candidates_;
  std::vector<Found> found_;
};

std::vector<std::string> only_in(const CompiledPort& port, const CompiledPort* other) {
  std::set<std::string> sources;
  for (const auto& rule : port.rules) sources.insert(rule.source);
  if (other != nullptr) {
    for (const auto& rule : other->rules) sources.erase(rule.source);
  }
  return {sources.begin(), sources.end()};
}

// Sources that are neither read nor connected in the other.
std::vector<std::string> read_only_in(const CompiledPort& port, const CompiledPort& other) {
  std::vector<std::string> sources;
  for (const std::string& source : port.reads) {
    if (find_rule(port, source) != nullptr || find_rule(other, source) != nullptr) continue;
    if (!std::binary_search(other.reads.begin(), other.reads.end(), source)) {
      sources.push_back(source);
    }
  }
  return sources;
}

// All but who wins.
PortDiff port_diff(const std::string& port, const CompiledPort* before, const CompiledPort* after) {
  PortDiff result;
  result.port = port;
  result.exists_before = before != nullptr;
  result.exists_after = after != nullptr;
  result.arbitrated_before = before != nullptr && before->arbitrated;
  result.arbitrated_after = after != nullptr && after->arbitrated;
  result.first_wins_before = before != nullptr && before->first_wins;
  result.first_wins_after = after != nullptr && after->first_wins;
  if (before != nullptr) result.connections_before = only_in(*before, after);
  if (after != nullptr) result.connections_after = only_in(*after, before);
  if (before != nullptr && after != nullptr) {
    result.reads_before = read_only_in(*before, *after);
    result.reads_after = read_only_in(*after, *before);
  }
  return result;
}

// Of the sources whose activity some decision depends on.
std::vector<ModelDiff::TimeoutChange> compare_timeouts(const CompiledModel& before,
                                                       const CompiledModel& after) {
  std::set<std::string> deciding;
  for (const CompiledModel* model : {&before, &after}) {
    for (const auto& port : model->ports) {
      if (!port.arbitrated) continue;
      deciding.insert(port.reads.begin(), port.reads.end());
      for (const auto& rule : port.rules) deciding.insert(rule.source);
    }
  }
  std::vector<ModelDiff::TimeoutChange> changes;
  bool default_changed = false;
  for (const auto& source : deciding) {
    const auto was = before.timeout_of(source), is = after.timeout_of(source);
    if (was == is) continue;
    if (before.timeouts.contains(source) || after.timeouts.contains(source)) {
      changes.push_back({source, was, is});
    } else {
      default_changed = true;
    }
  }
  if (default_changed) changes.insert(changes.begin(), {"", before.timeout, after.timeout});
  return changes;
}

}  // namespace

bool PortDiff::differs() const {
  return arbitrated_before != arbitrated_after || exists_before != exists_after ||
         !connections_before.empty() || !connections_after.empty() || !changes.empty();
}

bool ModelDiff::differs() const {
  return !timeouts.empty() || std::any_of(ports.begin(), ports.end(),
                                          [](const PortDiff& port) { return port.differs(); });
}

bool ModelDiff::is_open() const {
  return !differs() && std::any_of(ports.begin(), ports.end(),
                                   [](const PortDiff& port) { return !port.open.empty(); });
}

ModelDiff diff(const CompiledModel& before, const CompiledModel& after, Budget& budget) {
  using Sides = std::pair<const CompiledPort*, const CompiledPort*>;
  std::map<std::string, Sides> ports;
  for (const auto& port : before.ports) ports[port.port].first = &port;
  for (const auto& port : after.ports) ports[port.port].second = &port;
  std::vector<PortDiff> compared;
  std::vector<std::pair<std::size_t, Sides>>
      questions;  // of which ports who wins is to be compared
  for (const auto& [name, sides] : ports) {
    compared.push_back(port_diff(name, sides.first, sides.second));
    if (!compared.back().arbitrated_before || !compared.back().arbitrated_after) continue;
    questions.emplace_back(compared.size() - 1, sides);
  }
  share_out(
      budget, "comparing", questions.size(),
      [&](std::size_t i) { return compared[questions[i].first].port; },
      [&](std::size_t i) {
        const auto& [port, sides] = questions[i];
        compared[port] = port_diff(compared[port].port, sides.first, sides.second);
        PortComparison(*sides.first, *sides.second, compared[port]).compare(budget);
      });
  ModelDiff result;
  result.compared_ports = compared.size();
  for (PortDiff& port : compared) {
    const bool handles_conflicts_alike = port.first_wins_before == port.first_wins_after;
    if (port.differs() || !port.open.empty() || !handles_conflicts_alike) {
      result.ports.push_back(std::move(port));
    }
  }
  result.timeouts = compare_timeouts(before, after);
  return result;
}

}  // namespace arbiter::rules
