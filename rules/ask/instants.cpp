#include "rules/ask/instants.hpp"

#include <algorithm>
#include <map>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "rules/prove/winners.hpp"
#include "rules/text/names.hpp"

namespace arbiter::rules {
namespace {

// More pairs than can be listed are not looked at.
constexpr std::size_t kMaxPairs = Diagnostics::kMaxOfCode;
constexpr std::size_t kMaxExclusionsTold = 4;
// What it takes to set up the diagrams of two ports, in steps: a millisecond.
constexpr std::uint64_t kStepsToBegin = 10'000;

struct PortPair {
  const CompiledPort* one;
  const CompiledPort* other;
  std::vector<std::pair<const CompiledRule*, const CompiledRule*>> exclusions{};
  std::string limit{};  // why it is open
};

class Instants {
 public:
  Instants(const RuleSet& rules, const CompiledModel& model, const HostPlaces& places)
      : places_(places) {
    for (const PortRules& port : rules.ports) where_.emplace(port.port, &port.where);
    pair_up(model);
  }

  void find(Budget& budget) {
    share_out(
        budget, "looking for what two hosts decide", pairs_.size(),
        [&](std::size_t i) { return pairs_[i].one->port + " and " + pairs_[i].other->port; },
        [&](std::size_t i) { ask(pairs_[i], budget); });
  }

  void report(Diagnostics& diagnostics) const {
    std::size_t open = 0;
    const PortPair* first_open = is_cut_ ? &pairs_.back() : nullptr;
    for (const PortPair& pair : pairs_) {
      if (!pair.limit.empty()) {
        ++open;
        if (first_open == nullptr) first_open = &pair;
      } else if (!pair.exclusions.empty()) {
        note(pair, diagnostics);
      }
    }
    if (first_open == nullptr) return;
    const std::string& one = first_open->one->port;
    const std::string& other = first_open->other->port;
    const std::string beyond = is_cut_ ? ", nor of any beyond " + std::to_string(kMaxPairs) : "";
    diagnostics.note("left-open", *where_.at(one),
                     "which connections exclude each other was not found out of " +
                         std::to_string(open) + (open == 1 ? " pair" : " pairs") +
                         " of ports on different hosts" + beyond + ", such as " + one + " and " +
                         other + "; --effort allows more steps",
                     {.ports = {one, other}});
  }

 private:
  // Ports that have no source in common decide nothing about each other.
  void pair_up(const CompiledModel& model) {
    std::map<std::string_view, std::vector<const CompiledPort*>> readers;
    for (const CompiledPort& port : model.ports) {
      if (!port.arbitrated || places_.of_port(port.port).empty()) continue;
      SourceOrder sources;
      sources.add(port);
      std::set<const CompiledPort*> met;
      for (const std::string& source : sources.names()) {
        // A port of the model lives as long as the names of its sources.
        for (const CompiledPort* other : readers[name_in(source)]) {
          if (places_.of_port(other->port) != places_.of_port(port.port)) met.insert(other);
        }
        readers[name_in(source)].push_back(&port);
      }
      for (const CompiledPort* other : met) {
        is_cut_ = pairs_.size() == kMaxPairs;
        if (is_cut_) break;
        pairs_.push_back({other, &port});
      }
      if (is_cut_) break;
    }
    std::sort(pairs_.begin(), pairs_.end(), [](const PortPair& a, const PortPair& b) {
      return std::pair(a.one->port, a.other->port) < std::pair(b.one->port, b.other->port);
    });
  }

  std::string_view name_in(const std::string& source) { return *names_.insert(source).first; }

  static void ask(PortPair& pair, Budget& budget) {
    pair.exclusions.clear();
    pair.limit.clear();
    try {
      budget.spend(kStepsToBegin);
      find_exclusions(pair, budget);
    } catch (const StepLimit& limit) {
      pair.limit = limit.what();
      throw;
    } catch (const DiagramLimit& limit) {
      pair.limit = limit.what();
    }
  }

  static void find_exclusions(PortPair& pair, Budget& budget) {
    SourceOrder order;
    order.add(*pair.one);
    order.add(*pair.other);
    Winners winners(budget, order, false);
    const auto wins_of = [&](const CompiledPort& port) {
      std::vector<std::pair<const CompiledRule*, Diagram>> wins;
      for (const CompiledRule& rule : port.rules) {
        Diagram states = winners.winner(port, rule);
        if (!states.is_false()) wins.emplace_back(&rule, std::move(states));
      }
      return wins;
    };
    const auto at_one = wins_of(*pair.one), at_other = wins_of(*pair.other);
    for (const auto& [rule, states] : at_one) {
      for (const auto& [other, other_states] : at_other) {
        budget.spend(1);
        const Diagram both = winners.combine(Connective::kAnd, states, other_states);
        if (both.is_false()) pair.exclusions.emplace_back(rule, other);
      }
    }
  }

  void note(const PortPair& pair, Diagnostics& diagnostics) const {
    const std::string& one = pair.one->port;
    const std::string& other = pair.other->port;
    std::vector<std::string> told;
    Subject about{.ports = {one, other}};
    for (const auto& [rule, other_rule] : pair.exclusions) {
      if (told.size() == kMaxExclusionsTold) break;
      told.push_back(rule->source + " with " + other_rule->source);
      about.winners.emplace_back(one, rule->source);
      about.winners.emplace_back(other, other_rule->source);
    }
    const std::size_t more = pair.exclusions.size() - told.size();
    if (more > 0) told.push_back(std::to_string(more) + " more");
    diagnostics.note("not-at-one-instant", *where_.at(one),
                     "no state lets these win together at " + one + " (" +
                         std::string(places_.of_port(one)) + ") and " + other + " (" +
                         std::string(places_.of_port(other)) + "): " + enumerate(told) +
                         "; but two hosts do not see one state: while a sample crosses, and while "
                         "the network is cut, both may win; if they must not, put both ports on "
                         "one host",
                     std::move(about));
  }

  const HostPlaces& places_;
  std::map<std::string_view, const Location*> where_;
  std::set<std::string> names_;
  std::vector<PortPair> pairs_;
  bool is_cut_ = false;  // there are more pairs than these
};

}  // namespace

void find_instants(const RuleSet& rules, const CompiledModel& model, const HostPlaces& places,
                   Diagnostics& diagnostics, Budget& budget) {
  Instants instants(rules, model, places);
  instants.find(budget);
  instants.report(diagnostics);
}

}  // namespace arbiter::rules
