// Whether an expression is true, as far as it can be said while some sources are unknown (Kleene's
// logic).
#pragma once

#include <cstdint>
#include <functional>
#include <string>
#include <unordered_map>
#include <utility>

#include "rules/model/expression.hpp"

namespace arbiter::rules {

enum class Truth : std::uint8_t { kFalse, kTrue, kUnknown };

constexpr Truth truth(bool value) { return value ? Truth::kTrue : Truth::kFalse; }
constexpr Truth negate(Truth value) {
  if (value == Truth::kUnknown) return value;
  return truth(value == Truth::kFalse);
}

// Of expressions without quantifiers, under one assignment. Remembers each part, which expressions
// may share, so it must not outlive them.
class Evaluation {
 public:
  using Look = std::function<Truth(const std::string& source)>;
  explicit Evaluation(Look look) : look_(std::move(look)) {}

  Truth of(const Expression& expression);

 private:
  Truth evaluate_new(const Expression& expression);
  Truth join(const Expression& expression, Truth decisive);

  const Look look_;
  std::unordered_map<const Expression*, Truth> known_;
};

using IsActive = std::function<bool(const std::string& source)>;

// Of an expression without quantifiers, where all is known.
bool evaluate(const Expression& expression, const IsActive& is_active);

}  // namespace arbiter::rules
