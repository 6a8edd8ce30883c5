// What can be done about two connections of a port that can both win: only siblings may inhibit
// each other, and rules written by hand inhibit nothing.
#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <string_view>
#include <unordered_map>
#include <utility>
#include <vector>

#include "rules/model/rule_set.hpp"

namespace arbiter::rules {

class ConflictAdvice {
 public:
  // Keeps a reference.
  explicit ConflictAdvice(const RuleSet& rules) : rules_(rules) {}

  // By which inhibition, given the behaviours (indices into RuleSet::behaviours) that configure the
  // one and the other; empty: by none.
  [[nodiscard]] std::string inhibition(const std::vector<std::size_t>& one,
                                       const std::vector<std::size_t>& other);

 private:
  using Siblings = std::pair<std::string_view, std::string_view>;

  [[nodiscard]] std::string inhibition_of_all(const std::vector<std::size_t>& inhibitors,
                                              const std::vector<std::size_t>& inhibited);
  // Whether one of these is that behaviour, or stands in it.
  [[nodiscard]] bool is_any_in(std::string_view parent, const std::vector<std::size_t>& of);
  // Those of one parent that are, or contain, the one and the other; nothing: one contains the
  // other, or they are the same.
  [[nodiscard]] std::optional<Siblings> siblings_above(std::size_t one, std::size_t other);
  // It, and the meta-behaviours above it, the outermost first.
  [[nodiscard]] std::vector<std::string_view> way_to(std::string_view behaviour);

  const RuleSet& rules_;
  std::unordered_map<std::string_view, std::string_view> parents_;  // found at the first question
};

}  // namespace arbiter::rules
