// Is there a state of the sources in which …? For questions whose decision diagrams would be too
// large: a solver (CaDiCaL) looks for one state, where a diagram describes all of them at once. So
// it can tell that there is none, or show one, but not how many there are.
//
// Thread safety: none; a search is for one thread, and any number of them may live.
#pragma once

#include <algorithm>
#include <cstdint>
#include <initializer_list>
#include <memory>
#include <string>
#include <unordered_map>
#include <vector>

#include "rules/prove/compiled_model.hpp"
#include "rules/text/diagnostic.hpp"

namespace arbiter::rules {

class StateSearch {
 public:
  // That something is so; the negative number that it is not.
  using Proposition = int;
  enum class Answer { kYes, kNo, kOpen };

  // Of one question, and of all of one search: a second or two. A step is ten decisions of the
  // solver.
  static constexpr int kMaxSteps = 5'000;
  static constexpr int kMaxStepsInAll = 50'000;

  // Steps of a budget that one of a search takes about as long as.
  static constexpr std::uint64_t kBudgetPerStep = 200;
  static int steps_within(std::uint64_t budget) {
    return static_cast<int>(std::min<std::uint64_t>(budget / kBudgetPerStep, kMaxStepsInAll));
  }
  static std::uint64_t budget_of(int steps) {
    return static_cast<std::uint64_t>(std::max(steps, 0)) * kBudgetPerStep;
  }

  explicit StateSearch(int max_steps = kMaxStepsInAll);
  ~StateSearch();
  StateSearch(const StateSearch&) = delete;
  StateSearch& operator=(const StateSearch&) = delete;

  Proposition active(const std::string& source);
  // The rule's source is active, and its condition true.
  Proposition holds(const CompiledRule& rule);
  Proposition all_of(const std::vector<Proposition>& propositions);

  struct Port {
    std::vector<Proposition> wins;  // by rule
    Proposition nobody;
  };
  // Who wins at the port: of its rules the first that holds.
  Port winners(const CompiledPort& port);

  // From now on, one of them must be so.
  void require_any(const std::vector<Proposition>& propositions);

  [[nodiscard]] int steps_left() const;

  // Whether there is a state in which all of them are so.
  Answer find(const std::vector<Proposition>& propositions);
  // In the state that was found last.
  [[nodiscard]] bool is_so(Proposition proposition) const;
  // Of that state, in which the proposition is so, literals that imply it, whatever has been
  // required. None of them can be left out, as far as the steps reach.
  Witness witness(Proposition proposition);

 private:
  struct Solver;

  Proposition make() { return ++last_; }
  void add(std::initializer_list<Proposition> clause);
  Proposition choose(Proposition condition, Proposition high, Proposition low);
  Answer solve(const std::vector<Proposition>& assumptions);
  // Of what was assumed, what the solver has needed to find that nothing is so.
  std::vector<Proposition> needed(const std::vector<Proposition>& assumptions);

  std::unique_ptr<Solver> solver_;
  Proposition last_ = 0;
  const Proposition true_;
  // What is required holds only where this is assumed, so that witnesses do not rest on it.
  const Proposition required_;
  std::unordered_map<std::string, Proposition> sources_;
  std::vector<bool> found_;  // by proposition: the state that was found last
};

}  // namespace arbiter::rules
