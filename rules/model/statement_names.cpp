#include "rules/model/statement_names.hpp"

#include <algorithm>
#include <string_view>
#include <utility>

#include "rules/model/quantifiers.hpp"
#include "rules/text/names.hpp"

namespace arbiter::rules {
namespace {

std::vector<std::string> sorted(std::vector<std::string> names) {
  std::sort(names.begin(), names.end());
  return names;
}

}  // namespace

StatementNames::StatementNames(const std::vector<std::string>& sources, Ports ports)
    : sources_(sorted(sources)), ports_(std::move(ports)) {}

bool StatementNames::admit(const Statement& statement, Diagnostics& diagnostics) {
  statement_ = &statement;
  diagnostics_ = &diagnostics;
  bool has_meaning = true;
  for (const auto& term : statement.parsed.terms) has_meaning = check_term(term) && has_meaning;
  for (const auto& source : statement.parsed.sources) {
    has_meaning = check_source(source) && has_meaning;
  }
  for (const auto& glob : statement.parsed.globs) warn_if_unmatched(glob);
  return has_meaning;
}

bool StatementNames::check_term(const WinnerTerm& term) {
  const Port* const port = find_port(term.port);
  const Port* const other = term.other_port ? find_port(*term.other_port) : nullptr;
  if (port == nullptr || (term.other_port && other == nullptr)) return false;
  if (term.pattern) warn_if_none_wins(term.port.name, *port, *term.pattern);
  return !term.source || check_winner(term.port.name, *port, *term.source);
}

// An arbitrated one; null, reported, if it is none.
const StatementNames::Port* StatementNames::find_port(const Mention& mention) {
  const auto port = ports_.find(mention.name);
  if (port == ports_.end()) {
    report("unknown-port", mention,
           "the model has no input port " + mention.name + advice_on_port(mention.name),
           {.ports = {mention.name}});
    return nullptr;
  }
  if (port->second.is_arbitrated) return &port->second;
  report("not-arbitrated", mention,
         "no rule mentions " + mention.name +
             ": it is not arbitrated, everything is delivered there and nobody wins or loses; "
             "name a port that is arbitrated",
         {.ports = {mention.name}});
  return nullptr;
}

std::string StatementNames::advice_on_port(const std::string& name) {
  std::vector<std::string> connected;
  if (is_source(name)) {
    for (const auto& [port, known] : ports_) {
      const auto& sources = known.sources;
      const bool has_it = std::find(sources.begin(), sources.end(), name) != sources.end();
      if (has_it && known.is_arbitrated) connected.push_back(port);
    }
    return "; it is an output port: name an input port that is arbitrated" +
           (connected.empty() ? "" : ", as " + enumerate(connected) + ", which it is connected to");
  }
  std::vector<std::string_view> names;
  if (may_suggest()) {
    for (const auto& [port, known] : ports_) names.push_back(port);
  }
  return advise(name, names, "name one that is arbitrated");
}

bool StatementNames::check_winner(const std::string& port_name, const Port& port,
                                  const Mention& source) {
  const auto& connected = port.sources;
  if (std::find(connected.begin(), connected.end(), source.name) != connected.end()) return true;
  std::vector<std::string_view> names;
  if (may_suggest()) names.assign(connected.begin(), connected.end());
  report("not-connected", source,
         source.name + " is not connected to " + port_name + ", so that it can never win there" +
             advise(source.name, names, "name one of its connections"),
         {.ports = {port_name}, .source = source.name});
  return false;
}

void StatementNames::warn_if_none_wins(const std::string& port_name, const Port& port,
                                       const Mention& pattern) {
  if (std::any_of(port.sources.begin(), port.sources.end(),
                  [&](const auto& source) { return matches(pattern.name, source); })) {
    return;
  }
  diagnostics_->warning("matches-nothing", pattern.where,
                        "no source that is connected to " + port_name + " matches " +
                            quote(pattern.name) + ", so that none of these can win; " +
                            correction_of(pattern.name, {port.sources.begin(), port.sources.end()}),
                        {.ports = {port_name}, .statement = statement_->text});
}

bool StatementNames::check_source(const Mention& source) {
  if (is_source(source.name)) return true;
  if (ports_.find(source.name) != ports_.end()) {
    report("unknown-source", source,
           source.name + " is an input port, which is never active; name a source, or write idle(" +
               source.name + ") or winner(" + source.name + ") = SOURCE",
           {.source = source.name});
    return false;
  }
  std::vector<std::string_view> names;
  if (may_suggest()) names.assign(sources_.begin(), sources_.end());
  report("unknown-source", source,
         "neither the model nor its application names a source " + source.name +
             advise(source.name, names, "name one that it reads or connects"),
         {.source = source.name});
  return false;
}

bool StatementNames::is_source(const std::string& name) const {
  return std::binary_search(sources_.begin(), sources_.end(), name);
}

void StatementNames::warn_if_unmatched(const Mention& glob) {
  const auto [known, is_new] = matched_.try_emplace(glob.name);
  const auto fits = [&](const auto& source) { return matches(glob.name, source); };
  if (is_new) known->second = std::any_of(sources_.begin(), sources_.end(), fits);
  if (known->second) return;
  diagnostics_->warning("matches-nothing", glob.where,
                        "no source matches " + quote(glob.name) +
                            ": any() is false of it, all() and none() are true; " +
                            correction_of(glob.name, {sources_.begin(), sources_.end()}),
                        {.statement = statement_->text});
}

std::string StatementNames::correction_of(const std::string& pattern,
                                          const std::vector<std::string_view>& names) {
  const std::string similar = may_suggest() ? similar_pattern(pattern, names) : "";
  return similar.empty() ? "correct it" : "did you mean " + quote(similar) + "?";
}

void StatementNames::report(std::string code, const Mention& mention, std::string message,
                            Subject about) {
  about.statement = statement_->text;
  diagnostics_->error(std::move(code), mention.where, std::move(message), std::move(about));
}

// To compare a name with all others takes long, and nobody reads so many.
bool StatementNames::may_suggest() { return ++unknown_ <= kMaxSuggestions; }

}  // namespace arbiter::rules
