// Rules of which the first that holds wins, as somebody would write them down, and random
// conditions for them.
#pragma once

#include <cstddef>
#include <optional>
#include <random>
#include <string>
#include <utility>
#include <vector>

#include "tests/rules/rules_by_hand.hpp"

namespace arbiter::test {

using Rules = std::vector<std::pair<std::string, ExpressionPtr>>;

inline std::string numbered_source(std::size_t i) { return "/s" + std::to_string(1000 + i); }

// `s and not a and not b and not c`, with others at random.
inline Rules random_inhibitions(std::size_t count, unsigned seed) {
  std::mt19937 random(seed);
  Rules rules;
  for (std::size_t i = 0; i < count; ++i) {
    std::vector<ExpressionPtr> literals;
    while (literals.size() < 3) {
      const std::size_t other = random() % count;
      if (other != i) literals.push_back(inactive(numbered_source(other)));
    }
    rules.emplace_back(numbered_source(i), all_of(literals));
  }
  return rules;
}

// By the definition.
inline std::optional<std::string> first_that_holds(const Rules& rules, const Active& now) {
  for (const auto& [source, condition] : rules) {
    if (now.contains(source) && holds(*condition, now)) return source;
  }
  return std::nullopt;
}

// A tree of at most that many operators above each other. `leaf(pick)` makes what stands below
// them; pick(n) is less than n.
template <class Leaf>
ExpressionPtr random_condition(std::mt19937& random, int depth, const Leaf& leaf) {
  const auto pick = [&](std::size_t n) { return static_cast<std::size_t>(random()) % n; };
  if (depth == 0 || pick(4) == 0) return leaf(pick);
  static constexpr Operator kOperators[] = {Operator::kAnd, Operator::kOr, Operator::kXor,
                                            Operator::kImplies, Operator::kIff};
  auto left = random_condition(random, depth - 1, leaf);
  return binary(kOperators[pick(5)], std::move(left), random_condition(random, depth - 1, leaf));
}

}  // namespace arbiter::test
