// A shortest implicant of a function: the fewest literals that make it true, whatever the rest.
#pragma once

#include <cstdint>
#include <optional>
#include <unordered_map>
#include <vector>

#include "rules/prove/diagram.hpp"
#include "rules/prove/proof.hpp"

namespace arbiter::rules {

// What is said of a diagram's variable; rules::Literal says it of a source's name.
struct VariableLiteral {
  int variable;
  bool active;
};

// The shortest path through a diagram depends on the order of the variables and need not be it. The
// search follows the definition instead: an implicant of f with top variable x either leaves x out,
// and is then one of (f where x is false) and (f where x is true); or says which, and its rest is
// one of that half. It looks for one literal, then for two, and so on, so that what many literals
// would lead to is not looked at. Functions seen are remembered; there may be many, so they are
// bounded.
//
// Asked for an implicant of f that reaches g, it follows both: the implicant must be true in some
// state in which g is, too.
class ShortestImplicant {
 public:
  // How often the searches of one object take a function apart, and the steps of diagrams that they
  // take for it: a fraction of a second.
  static constexpr std::size_t kMaxSplits = 20'000;
  static constexpr std::size_t kMaxSteps = 2'000'000;

  explicit ShortestImplicant(DiagramBuilder& builder, std::size_t max_splits = kMaxSplits)
      : builder_(builder), max_splits_(max_splits), first_step_(builder.steps()) {}

  // Fewest literals, then fewest that are active; always the same one. Nothing if the bound is met.
  // Throws DiagramLimit, after which it can't be used again. For a function that can be true.
  std::optional<Literals> find(const Diagram& function);
  // The same, whatever the number of variables, of the implicants that reach `reached`. It and the
  // function can be true together.
  std::optional<std::vector<VariableLiteral>> find_literals(const Diagram& function,
                                                            const Diagram& reached);

  [[nodiscard]] std::size_t splits() const { return splits_; }

 private:
  enum class Choice : std::uint8_t { kNone, kLeaveOut, kInactive, kActive };
  struct Goal {
    Diagram function, reached;
    [[nodiscard]] bool is_impossible() const { return function.is_false() || reached.is_false(); }
    [[nodiscard]] std::uint64_t key() const;
  };
  struct Best {
    std::uint32_t cost;  // literals, and a little more for each active one; or more than that
    bool is_exact;
    Choice choice;
    int variable;  // that the choice is about; sifting may put another one on top meanwhile
    Goal rest;     // what remains to be implied
    Goal goal;     // keeps the nodes from being reused, so that they can be the key
  };

  // If it is less than `limit`; otherwise something that is not more than it, nor less than
  // `limit`.
  std::uint32_t cost(const Goal& goal, std::uint32_t limit);
  Best split(const Goal& goal, std::uint32_t limit);
  Goal without_what_is_above(Goal goal);

  DiagramBuilder& builder_;
  const std::size_t max_splits_;
  const std::size_t first_step_;
  std::size_t splits_ = 0;
  std::unordered_map<std::uint64_t, Best> best_;
};

// Literals that imply the function, of which none can be left out: those of a path to true, less
// what is not needed, of the active ones first. They reach `reached`.
std::vector<VariableLiteral> lean_implicant(DiagramBuilder& builder, const Diagram& function,
                                            const Diagram& reached);

}  // namespace arbiter::rules
