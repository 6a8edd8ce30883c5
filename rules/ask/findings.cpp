#include "rules/ask/findings.hpp"

#include <map>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "rules/ask/nobody_wins.hpp"
#include "rules/text/names.hpp"

namespace arbiter::rules {
namespace {

// Where a connection is written: its rule or, where it has none, in the application.
class Places {
 public:
  explicit Places(const RuleSet& rules) {
    for (const auto& port : rules.ports) {
      for (const auto& rule : port.rules)
        of_rules_.emplace(Key(rule.source, port.port), &rule.where);
    }
    for (const auto& each : rules.other_connections) {
      of_others_.emplace(Key(each.source, each.port), &each.where);
    }
  }
  // Null where the connection has no rule, or is none of the application's.
  [[nodiscard]] const Location* of_rule(const std::string& source, const std::string& port) const {
    return find(of_rules_, source, port);
  }
  [[nodiscard]] const Location* in_application(const std::string& source,
                                               const std::string& port) const {
    return find(of_others_, source, port);
  }

 private:
  using Key = std::pair<std::string_view, std::string_view>;
  using Map = std::map<Key, const Location*>;

  static const Location* find(const Map& places, const std::string& source,
                              const std::string& port) {
    const auto found = places.find(Key(source, port));
    return found == places.end() ? nullptr : found->second;
  }

  Map of_rules_;
  Map of_others_;
};

// Sources that are connected to arbitrated ports only, and win at none of them. Where it is one
// connection with a rule, compile() has said so. Told at the first rule of the source, for that can
// be mended; if it has none, at its first connection in the application.
void warn_of_losers(const RuleSet& rules, const CompiledModel& model, Diagnostics& diagnostics) {
  struct Losing {
    std::vector<std::string> ports;
    bool wins = false;
    bool lacks_rule = false;
    const Location* of_rule = nullptr;
    const Location* in_application = nullptr;
  };
  const Places places(rules);
  std::map<std::string, Losing> sources;
  for (const auto& port : model.ports) {
    for (const auto& rule : port.rules) {
      Losing& source = sources[rule.source];
      source.wins = source.wins || rule.kind != shm::table::kNever;
      source.ports.push_back(port.port);
      const Location* const own = places.of_rule(rule.source, port.port);
      source.lacks_rule = source.lacks_rule || own == nullptr;
      if (source.of_rule == nullptr) source.of_rule = own;
      if (source.in_application == nullptr) {
        source.in_application = places.in_application(rule.source, port.port);
      }
    }
  }
  for (const auto& [source, losing] : sources) {
    if (losing.wins || (losing.ports.size() == 1 && !losing.lacks_rule)) continue;
    const Location* const where =
        losing.of_rule != nullptr ? losing.of_rule : losing.in_application;
    diagnostics.warning("never-wins", where == nullptr ? Location() : *where,
                        source + " is connected to " + enumerate(losing.ports) +
                            ", and there is no state in which it wins anywhere" +
                            (losing.lacks_rule ? ", partly since no rule selects it" : "") +
                            "; give it a behaviour that can run, or remove its connections",
                        {.ports = losing.ports, .source = source});
  }
}

// Throws DiagramLimit. What the statements cover may be too hard to find out; then they quiet
// nothing.
void look_at(const PortRules& rules, const CompiledPort& port, const ProvedStatements& statements,
             Diagnostics& diagnostics, Budget& budget) {
  ProvedStatements own;
  for (const auto& statement : statements) {
    if (speaks_of(*statement, port)) own.push_back(statement);
  }
  if (!own.empty()) {
    try {
      Diagnostics found;
      const Budget::Part part(budget, budget.left() / 2);
      find_where_nobody_wins(rules, port, own, found, budget);
      diagnostics.add(std::move(found));
      return;
    } catch (const DiagramLimit&) {
      own.clear();
    }
  }
  find_where_nobody_wins(rules, port, own, diagnostics, budget);
}

}  // namespace

FindingsAccount find_more(const RuleSet& rules, const CompiledModel& model,
                          Diagnostics& diagnostics, Budget& budget,
                          const ProvedStatements& statements) {
  warn_of_losers(rules, model, diagnostics);
  std::map<std::string, const CompiledPort*> compiled;
  for (const auto& port : model.ports) compiled.emplace(port.port, &port);
  struct PortQuestion {
    const PortRules* rules;
    const CompiledPort* port;
    Diagnostics found;
    std::string limit;  // why it is open
  };
  std::vector<PortQuestion> questions;
  for (const auto& port : rules.ports) {
    const auto found = compiled.find(port.port);
    if (found != compiled.end()) questions.push_back({&port, found->second, {}, {}});
  }
  const auto ask = [&](std::size_t i) {
    PortQuestion& question = questions[i];
    question.found = {};
    question.limit.clear();
    try {
      look_at(*question.rules, *question.port, statements, question.found, budget);
    } catch (const StepLimit& limit) {
      question.limit = limit.what();
      throw;
    } catch (const DiagramLimit& limit) {
      question.limit = limit.what();
    }
  };
  share_out(
      budget, "looking for states in which nobody wins", questions.size(),
      [&](std::size_t i) { return questions[i].rules->port; }, ask);
  FindingsAccount account{questions.size(), 0};
  std::vector<std::string> open;  // ports
  std::string why_open;           // of the first
  Location first_open;
  for (PortQuestion& question : questions) {
    diagnostics.add(std::move(question.found));
    if (question.limit.empty()) continue;
    if (open.empty()) first_open = question.rules->where, why_open = question.limit;
    open.push_back(question.rules->port);
  }
  account.open = open.size();
  if (open.empty()) return account;
  const std::string first = open.size() > 1 ? "at " + open.front() + ", " : "";
  const std::string message = "not all states in which nobody wins at " + enumerate(open) +
                              " were looked at: " + first + "it takes " + why_open +
                              "; the model is still valid; --effort allows more steps";
  diagnostics.note("left-open", first_open, message, {.ports = std::move(open)});
  return account;
}

}  // namespace arbiter::rules
