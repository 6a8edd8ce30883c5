// Why an expression has the value that it has: a small part of an activation that is enough.
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
// the other sources do changes it. In byte order.
//
// For up to kMaxSourcesForSmallest sources it is of the smallest possible size: empty if no
// activation makes the expression otherwise; and of several of that size one with `preferred` in
// it, if there is one. Null: any.
//
// For more sources, finding that would take too long. The reason then follows the form of the
// expression, and is small where that is simple. It may be larger than it need be, is not empty
// even if the expression never changes, and may lack `preferred` though one as small has it.
std::vector<Literal> sufficient_reason(const Expression& expression, const IsActive& is_active,
                                       const std::string* preferred = nullptr);

}  // namespace arbiter::rules
