// Why an expression has the value that it has: the smallest part of an activation that is enough.
#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include "rules/model/evaluation.hpp"
#include "rules/model/expression.hpp"

namespace arbiter::rules {

// That a source is active, or that it is not.
struct Literal {
  std::string source;
  bool active = false;

  friend bool operator==(const Literal&, const Literal&) = default;
};

// How many sources an expression may have for its reason to be surely of the smallest size.
inline constexpr std::size_t kMaxSourcesForSmallest = 10;

// What of the activation makes the expression as it is: while these stay as they are, nothing that
// the other sources do changes it. In byte order; empty where no activation makes it otherwise. Of
// the smallest possible size for expressions of up to kMaxSourcesForSmallest sources; of larger
// ones a small one, but to find the smallest would take too long. Of several of one size, it is one
// with `preferred` in it, where there is such a one; null: any.
std::vector<Literal> sufficient_reason(const Expression& expression, const IsActive& is_active,
                                       const std::string* preferred = nullptr);

}  // namespace arbiter::rules
