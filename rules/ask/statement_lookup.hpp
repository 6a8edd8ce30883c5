// What a statement speaks of, looked up in a compiled model.
#pragma once

#include <functional>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <unordered_map>
#include <vector>

#include "rules/model/statement.hpp"
#include "rules/prove/compile.hpp"
#include "rules/prove/question.hpp"
#include "rules/text/diagnostic.hpp"
#include "rules/text/names.hpp"

namespace arbiter::rules {

class StatementLookup {
 public:
  // Keeps references.
  StatementLookup(const CompiledModel& model, Diagnostics& diagnostics);

  // The statement's terms. Nothing where it speaks of ports, sources or connections that the model
  // does not have, or of ports that are not arbitrated: they are reported as errors. Patterns that
  // nothing matches are warned of.
  std::optional<std::vector<Term>> find(const Statement& statement);

  // Of a port that some term has named.
  [[nodiscard]] const CompiledPort& port(const std::string& name) const { return *ports_.at(name); }

 private:
  std::optional<Term> find_term(const WinnerTerm& term);
  const CompiledPort* find_port(const Mention& mention);
  const CompiledRule* find_rule(const CompiledPort& port, const Mention& source);
  std::vector<const CompiledRule*> find_rules(const CompiledPort& port, const Mention& pattern);
  bool is_known(const Mention& source);
  void warn_if_unmatched(const Mention& glob);
  void report(std::string code, const Mention& mention, std::string message, Subject about);
  // To compare a name with all others takes long, and nobody reads so many.
  bool may_suggest() { return ++unknown_ <= kMaxSuggestions; }

  Diagnostics& diagnostics_;
  std::set<std::string, std::less<>> sources_;
  std::map<std::string, const CompiledPort*> ports_;
  std::unordered_map<std::string, bool> matched_;  // by pattern: whether any source does
  const Statement* statement_ = nullptr;           // the one that is looked up
  std::size_t unknown_ = 0;
};

}  // namespace arbiter::rules
