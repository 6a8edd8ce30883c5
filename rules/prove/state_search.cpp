#include "rules/prove/state_search.hpp"

#include <algorithm>
#include <cadical.hpp>
#include <cstdlib>
#include <utility>

namespace arbiter::rules {
namespace {

constexpr int kSatisfiable = 10, kUnsatisfiable = 20;  // what a solver answers, by convention

}  // namespace

struct StateSearch::Solver : CaDiCaL::Solver {
  // The solver asks after every ten decisions.
  struct Steps : CaDiCaL::Terminator {
    bool terminate() override {
      --left;
      return --left_of_question < 0 || left < 0;
    }
    int left = 0;
    int left_of_question = 0;
  };

  explicit Solver(int max_steps) {
    steps.left = max_steps;
    connect_terminator(&steps);
  }
  ~Solver() { disconnect_terminator(); }
  Solver(const Solver&) = delete;
  Solver& operator=(const Solver&) = delete;

  Steps steps;
};

StateSearch::StateSearch(int max_steps)
    : solver_(std::make_unique<Solver>(max_steps)), true_(make()), required_(make()) {
  // Many easy questions of one small problem: what is done to it beforehand would not pay. Sources
  // are tried inactive first, so that few are active in what is shown.
  solver_->configure("plain");
  solver_->set("quiet", 1);
  solver_->set("phase", 0);
  add({true_});
}

StateSearch::~StateSearch() = default;

int StateSearch::steps_left() const { return std::max(0, solver_->steps.left); }

void StateSearch::add(std::initializer_list<Proposition> clause) {
  for (const Proposition each : clause) solver_->add(each);
  solver_->add(0);
}

StateSearch::Proposition StateSearch::active(const std::string& source) {
  const auto [found, is_new] = sources_.try_emplace(source, 0);
  if (is_new) found->second = make();
  return found->second;
}

StateSearch::Proposition StateSearch::all_of(const std::vector<Proposition>& propositions) {
  const Proposition all = make();
  for (const Proposition each : propositions) add({-all, each});
  for (const Proposition each : propositions) solver_->add(-each);
  solver_->add(all);
  solver_->add(0);
  return all;
}

// The last two follow from the others, but help the solver.
StateSearch::Proposition StateSearch::choose(Proposition condition, Proposition high,
                                             Proposition low) {
  const Proposition result = make();
  add({-condition, -high, result});
  add({-condition, high, -result});
  add({condition, -low, result});
  add({condition, low, -result});
  add({-high, -low, result});
  add({high, low, -result});
  return result;
}

StateSearch::Proposition StateSearch::holds(const CompiledRule& rule) {
  using shm::table::kFalse;
  if (rule.kind == shm::table::kNever) return -true_;
  std::vector<Proposition> all{active(rule.source)};
  for (std::size_t i = 0; i < rule.expected.size(); ++i) {
    const Proposition read = active(rule.reads[i]);
    all.push_back(rule.expected[i] ? read : -read);
  }
  std::vector<Proposition> nodes(rule.nodes.size());
  const auto of = [&](shm::Word node) {
    return node < kFalse ? nodes[node] : node == kFalse ? -true_ : true_;
  };
  for (std::size_t i = nodes.size(); i-- > 0;) {
    const auto& node = rule.nodes[i];
    nodes[i] = choose(active(rule.reads[node.position]), of(node.high), of(node.low));
  }
  if (!nodes.empty()) all.push_back(nodes.front());
  return all_of(all);
}

StateSearch::Port StateSearch::winners(const CompiledPort& port) {
  Port result{{}, true_};
  for (const auto& rule : port.rules) {
    const Proposition rule_holds = holds(rule);
    result.wins.push_back(all_of({result.nobody, rule_holds}));
    result.nobody = all_of({result.nobody, -rule_holds});
  }
  return result;
}

void StateSearch::require_any(const std::vector<Proposition>& propositions) {
  for (const Proposition each : propositions) solver_->add(each);
  solver_->add(-required_);
  solver_->add(0);
}

StateSearch::Answer StateSearch::solve(const std::vector<Proposition>& assumptions) {
  if (solver_->steps.left <= 0) return Answer::kOpen;
  --solver_->steps.left;
  solver_->steps.left_of_question = kMaxSteps;
  for (const Proposition each : assumptions) solver_->assume(each);
  switch (solver_->solve()) {
    case kSatisfiable:
      return Answer::kYes;
    case kUnsatisfiable:
      return Answer::kNo;
    default:
      return Answer::kOpen;
  }
}

StateSearch::Answer StateSearch::find(const std::vector<Proposition>& propositions) {
  std::vector<Proposition> assumptions = propositions;
  assumptions.push_back(required_);
  const Answer answer = solve(assumptions);
  if (answer != Answer::kYes) return answer;
  found_.resize(static_cast<std::size_t>(last_) + 1);
  for (Proposition each = 1; each <= last_; ++each) {
    found_[static_cast<std::size_t>(each)] = solver_->val(each) > 0;
  }
  return answer;
}

bool StateSearch::is_so(Proposition proposition) const {
  return found_[static_cast<std::size_t>(std::abs(proposition))] == (proposition > 0);
}

std::vector<StateSearch::Proposition> StateSearch::needed(
    const std::vector<Proposition>& assumptions) {
  std::vector<Proposition> result;
  for (const Proposition each : assumptions) {
    if (solver_->failed(each)) result.push_back(each);
  }
  return result;
}

// All sources together imply it. Where it can still be false once a literal is gone, that one must
// stay, for it can then be false with less, too; otherwise the solver says which of the others it
// has needed to find that it cannot.
Witness StateSearch::witness(Proposition proposition) {
  std::vector<std::pair<std::string, Proposition>> sources(sources_.begin(), sources_.end());
  std::sort(sources.begin(), sources.end());
  std::vector<Proposition> open;  // those that may be left out; tried from the last on
  for (const bool is_active : {false, true}) {
    for (const auto& [name, source] : sources) {
      if (is_so(source) == is_active) open.push_back(is_active ? source : -source);
    }
  }
  std::vector<Proposition> kept;
  const auto can_do_without = [&] {
    std::vector<Proposition> assumptions = open;
    assumptions.insert(assumptions.end(), kept.begin(), kept.end());
    assumptions.push_back(-proposition);
    if (solve(assumptions) != Answer::kNo) return false;
    open = needed(open);
    return true;
  };
  can_do_without();
  while (!open.empty()) {
    const Proposition literal = open.back();
    open.pop_back();
    if (!can_do_without()) kept.push_back(literal);
  }
  Witness result;
  for (const auto& [name, source] : sources) {
    for (const Proposition literal : kept) {
      if (std::abs(literal) != source) continue;
      (literal > 0 ? result.active : result.inactive).push_back(name);
    }
  }
  return result;
}

}  // namespace arbiter::rules
