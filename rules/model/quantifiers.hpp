// Quantifiers: any(GLOB), all(GLOB), none(GLOB) over the sources that a model names.
#pragma once

#include <map>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "rules/model/expression.hpp"
#include "rules/model/model.hpp"

namespace arbiter::rules {

// Whether the pattern fits the whole name; '*' stands for any characters, none and '/' included.
bool matches(std::string_view pattern, std::string_view name);

// What a pattern that matches none of the names was probably meant to be: "/Base/*" for "/Bse/*"
// and for "Base/*". Empty: nothing like it is there.
[[nodiscard]] std::string similar_pattern(const std::string& pattern,
                                          const std::vector<std::string_view>& names);

// The sources that a model names, in configs, conditions, rules or <source>, in byte order.
std::vector<std::string> collect_sources(const Model& model);

// Replaces quantifiers by what they say of these sources. Over no match they are false, true, true.
class QuantifierExpansion {
 public:
  explicit QuantifierExpansion(const std::vector<std::string>& sources) : sources_(sources) {}

  // The expression itself where it has no quantifier.
  ExpressionPtr expand(const ExpressionPtr& expression);

  // The patterns that have fitted nothing since this was asked last, each once.
  std::vector<std::string> take_unmatched() { return std::exchange(unmatched_, {}); }

 private:
  ExpressionPtr expand_quantifier(const Expression& quantifier);

  const std::vector<std::string>& sources_;
  std::map<std::pair<Operator, std::string>, ExpressionPtr> expanded_;
  std::vector<std::string> unmatched_;
};

}  // namespace arbiter::rules
