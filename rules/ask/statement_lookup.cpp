#include "rules/ask/statement_lookup.hpp"

#include <algorithm>
#include <string_view>
#include <utility>

#include "rules/model/quantifiers.hpp"

namespace arbiter::rules {

StatementLookup::StatementLookup(const CompiledModel& model, Diagnostics& diagnostics)
    : diagnostics_(diagnostics), sources_(model.sources.begin(), model.sources.end()) {
  for (const auto& port : model.ports) ports_.emplace(port.port, &port);
}

std::optional<std::vector<Term>> StatementLookup::find(const Statement& statement) {
  statement_ = &statement;
  bool has_meaning = true;
  std::vector<Term> terms;
  for (const auto& term : statement.parsed.terms) {
    const auto found = find_term(term);
    has_meaning = has_meaning && found.has_value();
    if (!found) continue;
    terms.push_back(*found);
  }
  for (const auto& source : statement.parsed.sources) {
    has_meaning = is_known(source) && has_meaning;
  }
  for (const auto& glob : statement.parsed.globs) warn_if_unmatched(glob);
  if (!has_meaning) return std::nullopt;
  return terms;
}

std::optional<Term> StatementLookup::find_term(const WinnerTerm& term) {
  const CompiledPort* const port = find_port(term.port);
  const CompiledPort* const other = term.other_port ? find_port(*term.other_port) : nullptr;
  if (port == nullptr || (term.other_port && other == nullptr)) return std::nullopt;
  Term result{port};
  if (other != nullptr) {
    result.other = other;
  } else if (term.pattern) {
    result.rules = find_rules(*port, *term.pattern);
  } else if (term.source) {
    const CompiledRule* const rule = find_rule(*port, *term.source);
    if (rule == nullptr) return std::nullopt;
    result.rules = {rule};
  } else {
    result.nobody = true;
  }
  return result;
}

// An arbitrated one; null, reported, if it is none.
const CompiledPort* StatementLookup::find_port(const Mention& mention) {
  const auto port = ports_.find(mention.name);
  if (port == ports_.end()) {
    std::vector<std::string_view> names;
    if (may_suggest()) {
      for (const auto& [name, known] : ports_) names.push_back(name);
    }
    report("unknown-port", mention,
           "the model has no input port " + mention.name +
               advise(mention.name, names, "name one that is arbitrated"),
           {.ports = {mention.name}});
    return nullptr;
  }
  if (port->second->arbitrated) return port->second;
  report("not-arbitrated", mention,
         "no rule mentions " + mention.name +
             ": it is not arbitrated, everything is delivered there and nobody wins or loses; "
             "name a port that is arbitrated",
         {.ports = {mention.name}});
  return nullptr;
}

// Of a connection; null, reported, if there is none.
const CompiledRule* StatementLookup::find_rule(const CompiledPort& port, const Mention& source) {
  for (const auto& rule : port.rules) {
    if (rule.source == source.name) return &rule;
  }
  std::vector<std::string_view> names;
  if (may_suggest()) {
    for (const auto& rule : port.rules) names.push_back(rule.source);
  }
  report("not-connected", source,
         source.name + " is not connected to " + port.port + ", so that it can never win there" +
             advise(source.name, names, "name one of its connections"),
         {.ports = {port.port}, .source = source.name});
  return nullptr;
}

std::vector<const CompiledRule*> StatementLookup::find_rules(const CompiledPort& port,
                                                             const Mention& pattern) {
  std::vector<const CompiledRule*> rules;
  for (const auto& rule : port.rules) {
    if (matches(pattern.name, rule.source)) rules.push_back(&rule);
  }
  if (rules.empty()) {
    diagnostics_.warning("matches-nothing", pattern.where,
                         "no source that is connected to " + port.port + " matches " +
                             quote(pattern.name) + ", so that none of these can win; correct it",
                         {.ports = {port.port}, .statement = statement_->text});
  }
  return rules;
}

void StatementLookup::report(std::string code, const Mention& mention, std::string message,
                             Subject about) {
  about.statement = statement_->text;
  diagnostics_.error(std::move(code), mention.where, std::move(message), std::move(about));
}

bool StatementLookup::is_known(const Mention& source) {
  if (sources_.contains(source.name)) return true;
  std::vector<std::string_view> names;
  if (may_suggest()) names.assign(sources_.begin(), sources_.end());
  report("unknown-source", source,
         "neither the model nor its application names a source " + source.name +
             advise(source.name, names, "name one that it reads or connects"),
         {.source = source.name});
  return false;
}

void StatementLookup::warn_if_unmatched(const Mention& glob) {
  const auto [known, is_new] = matched_.try_emplace(glob.name);
  const auto fits = [&](const auto& source) { return matches(glob.name, source); };
  if (is_new) known->second = std::any_of(sources_.begin(), sources_.end(), fits);
  if (known->second) return;
  diagnostics_.warning("matches-nothing", glob.where,
                       "no source matches " + quote(glob.name) +
                           ": any() is false of it, all() and none() are true; correct it",
                       {.statement = statement_->text});
}

}  // namespace arbiter::rules
