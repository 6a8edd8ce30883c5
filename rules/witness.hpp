// A shortest implicant of a function: the fewest literals that make it true, whatever the rest.
#pragma once

#include <cstdint>
#include <optional>
#include <unordered_map>
#include <vector>

#include "rules/diagram.hpp"
#include "rules/proof.hpp"

namespace arbiter::rules {

// What is said of a diagram's variable; rules::Literal says it of a source's name.
struct VariableLiteral {
  int variable;
  bool active;
};

// The shortest path through a diagram depends on the order of the variables and need not be it. The
// search follows the definition instead: an implicant of f with top variable x either leaves x out,
// and is then one of (f where x is false) and (f where x is true); or says which, and its rest is
// one of that half. Functions seen are remembered; there may be many, so they are bounded.
class ShortestImplicant {
 public:
  // Functions that the searches of one object look at together.
  static constexpr std::size_t kMaxFunctions = 20'000;

  explicit ShortestImplicant(DiagramBuilder& builder) : builder_(builder) {}

  // Fewest literals, then fewest that are active; always the same one. Nothing if the bound is met.
  // Throws DiagramLimit, after which it can't be used again. For a function that can be true.
  std::optional<Literals> find(const Diagram& function);
  // The same, whatever the number of variables.
  std::optional<std::vector<VariableLiteral>> find_literals(const Diagram& function);

  // How many functions the searches have looked at.
  [[nodiscard]] std::size_t functions() const { return best_.size(); }

 private:
  enum class Choice : std::uint8_t { kNone, kLeaveOut, kInactive, kActive };
  struct Best {
    std::uint32_t cost;  // literals, and a little more for each active one
    Choice choice;
    int variable;      // that the choice is about; sifting may put another one on top meanwhile
    Diagram rest;      // what remains to be implied
    Diagram function;  // keeps the node from being reused, so that it can be the key
  };

  std::uint32_t cost(const Diagram& function);

  DiagramBuilder& builder_;
  std::unordered_map<int, Best> best_;
};

}  // namespace arbiter::rules
