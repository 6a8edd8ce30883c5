// Where a model says that a source must be inactive: the condition or the inhibition behind a rule.
#pragma once

#include <cstddef>
#include <map>
#include <string>
#include <utility>
#include <vector>

#include "rules/model/provenance.hpp"
#include "rules/model/quantifiers.hpp"
#include "rules/model/rule_set.hpp"
#include "rules/prove/budget.hpp"
#include "rules/text/diagnostic.hpp"

namespace arbiter::rules {

class NegationPlaces {
 public:
  // Keeps references. Rules without provenance are told by their connections alone.
  NegationPlaces(const RuleSet& rules, Budget& budget);

  // Of `source` in the rule of that port: the first place of a condition, of the name in an
  // <inhibition>, or of a <select>. With conflict="first" the rules before it count as well, and
  // are looked at last. The rule's own place where there is none. Takes the one instance of
  // diagrams where a condition says both of the source.
  [[nodiscard]] Location find(const std::string& source, const PortRules& port,
                              const ConnectionRule& rule);

 private:
  enum class Asked { kInactive, kActive };
  // Of the part of a rule that asks this of the source; without a file: no part does.
  [[nodiscard]] Location place(const std::string& source, Asked asked, const std::string& port,
                               const ConnectionRule& rule);
  [[nodiscard]] Location place_in_behaviour(const std::string& source, Asked asked,
                                            const std::string& port, std::size_t behaviour);
  [[nodiscard]] bool asks(const ExpressionPtr& condition, const std::string& source, Asked asked);
  // Whether the condition depends on the source in that way.
  [[nodiscard]] bool depends(const ExpressionPtr& condition, const std::string& source,
                             Asked asked);
  // Whether an inhibition by this behaviour waits for the silence of the source.
  [[nodiscard]] bool speaks(const std::string& source, const std::string& port,
                            std::size_t behaviour) const;

  const RuleSet& rules_;
  Budget& budget_;
  QuantifierExpansion expansion_;
  using Connection = std::pair<std::string, std::string>;      // source and port
  std::map<Connection, std::vector<std::size_t>> behaviours_;  // that configure it
  std::map<Connection, const Select*> selects_;
};

}  // namespace arbiter::rules
