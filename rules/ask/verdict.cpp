#include "rules/ask/verdict.hpp"

#include <algorithm>
#include <map>
#include <set>

#include "rules/model/quantifiers.hpp"
#include "rules/model/statement_names.hpp"
#include "rules/prove/question.hpp"
#include "rules/prove/winners.hpp"

namespace arbiter::rules {
namespace {

using Active = std::set<std::string>;

// Before a statement about whole ports is looked at case by case: a second or two.
constexpr std::uint64_t kMaxStepsAtOnce = 16'000'000;

}  // namespace

struct ProvedStatement {
  ExpressionPtr expression;
  std::vector<Term> terms;
};

namespace {

// A statement that has a meaning in the model.
struct Case {
  Verdict verdict;
  ExpressionPtr expression;  // quantifiers expanded
  std::vector<Term> terms;
  std::set<std::string> ports;  // that it speaks of

  // Some part of it takes all rules of a port.
  [[nodiscard]] bool has_cases() const {
    return std::any_of(terms.begin(), terms.end(),
                       [](const Term& term) { return term.is_of_all(); });
  }
};

// What statements about the same ports share.
struct SharedScene {
  SharedScene(Budget& budget, const SourceOrder& order) : winners(budget, order) {}

  Winners winners;
  Scene scene{winners};
};

class Judge {
 public:
  Judge(const CompiledModel& model, Diagnostics& diagnostics, Budget& budget)
      : diagnostics_(diagnostics),
        budget_(budget),
        expansion_(model.sources),
        names_(model.sources, ports_of(model)) {
    for (const auto& port : model.ports) ports_.emplace(port.port, &port);
  }

  std::vector<Verdict> judge(const std::vector<Statement>& statements) {
    for (const Statement& statement : statements) admit(statement);
    // Those about the same ports after each other, for they share a scene.
    std::vector<std::size_t> order(cases_.size());
    for (std::size_t i = 0; i < order.size(); ++i) order[i] = i;
    std::stable_sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) {
      return cases_[a].ports < cases_[b].ports;
    });
    share_out(
        budget_, "judging statements", order.size(),
        [&](std::size_t i) { return cases_[order[i]].verdict.statement; },
        [&](std::size_t i) { decide(cases_[order[i]]); });
    std::vector<Verdict> verdicts;
    for (Case& each : cases_) verdicts.push_back(std::move(each.verdict));
    return verdicts;
  }

 private:
  // Unless it speaks of what the model does not have, which is reported.
  void admit(const Statement& statement) {
    if (!names_.admit(statement, diagnostics_)) return;
    Case admitted;
    for (const auto& term : statement.parsed.terms) admitted.terms.push_back(term_of(term));
    admitted.expression = expansion_.expand(statement.parsed.expression);
    admitted.verdict.statement = statement.text;
    admitted.verdict.where = statement.where;
    for (const auto* port : ports_of(admitted.terms)) {
      admitted.verdict.ports.push_back(port->port);
      admitted.ports.insert(port->port);
    }
    cases_.push_back(std::move(admitted));
  }

  // Throws StepLimit, and then the verdict is that the question is open.
  void decide(Case& of) {
    Verdict& verdict = of.verdict;
    verdict.kind = Verdict::Kind::kOpen;
    try {
      verdict.witness = refute(of);
    } catch (const StepLimit& limit) {
      verdict.limit = limit.what();
      throw;
    } catch (const DiagramLimit& limit) {
      verdict.limit = limit.what();
      return;
    }
    verdict.limit.clear();
    verdict.kind = verdict.witness ? Verdict::Kind::kRefuted : Verdict::Kind::kProved;
    if (!verdict.witness) {
      verdict.proved =
          std::make_shared<const ProvedStatement>(ProvedStatement{of.expression, of.terms});
      return;
    }
    const Active active(verdict.witness->active.begin(), verdict.witness->active.end());
    for (const auto* port : ports_of(of.terms)) {
      const CompiledRule* winner = find_winner(*port, active);
      verdict.winners.emplace_back(
          port->port, winner == nullptr ? std::nullopt : std::optional(winner->source));
    }
  }

  std::optional<Witness> refute(const Case& of) {
    std::set<std::string> sources;
    std::set<const Expression*> seen;
    add_sources_of(*of.expression, sources, seen);
    budget_.spend(sources.size());
    set_scene(of.ports, sources);
    try {
      Question question(*of.expression, of.terms, shared_->scene);
      if (!question.has_cases()) return question.refute(Question::Way::kAtOnce);
      const Budget::Part part(budget_, std::min(budget_.left() / 2, kMaxStepsAtOnce));
      return question.refute(Question::Way::kAtOnce);
    } catch (const StepLimit&) {
      if (!of.has_cases()) throw;
    } catch (const DiagramLimit&) {
      shared_.reset();
      if (!of.has_cases()) throw;
    }
    return refute_by_cases(of, sources);
  }

  std::optional<Witness> refute_by_cases(const Case& of, const std::set<std::string>& sources) {
    set_scene(of.ports, sources);
    try {
      return Question(*of.expression, of.terms, shared_->scene).refute(Question::Way::kByCases);
    } catch (const StepLimit&) {
      throw;
    } catch (const DiagramLimit&) {
      shared_.reset();
      throw;
    }
  }

  // Goes on with the one that there is if it is of these ports, and knows these sources.
  void set_scene(const std::set<std::string>& ports, const std::set<std::string>& sources) {
    const auto is_known = [&](const std::string& source) {
      return source.starts_with('=') || scene_sources_.contains(source);
    };
    if (shared_ && scene_ports_ == ports && std::all_of(sources.begin(), sources.end(), is_known)) {
      return;
    }
    shared_.reset();
    SourceOrder order;
    for (const auto& port : ports) order.add(*ports_.at(port));
    for (const auto& source : sources_with(ports, sources)) {
      if (!source.starts_with('=')) order.add(source);
    }
    shared_.emplace(budget_, order);
    scene_ports_ = ports;
    const auto& names = shared_->winners.sources();
    scene_sources_ = {names.begin(), names.end()};
  }

  // What all statements about these ports read or, where that is too much, these sources.
  const std::set<std::string>& sources_with(const std::set<std::string>& ports,
                                            const std::set<std::string>& sources) {
    constexpr std::size_t kMost = DiagramBuilder::kMaxVariables;
    const auto [found, is_new] = read_with_.try_emplace(ports);
    auto& all = found->second;
    std::set<const Expression*> seen;
    for (std::size_t i = 0; is_new && i < cases_.size() && all.size() <= kMost; ++i) {
      if (cases_[i].ports == ports) add_sources_of(*cases_[i].expression, all, seen);
    }
    const bool has_room = all.size() + ports.size() * shm::kMaxSourcesPerPort <= kMost;
    return has_room ? all : sources;
  }

  static StatementNames::Ports ports_of(const CompiledModel& model) {
    StatementNames::Ports ports;
    for (const auto& port : model.ports) {
      StatementNames::Port& known = ports[port.port];
      known.is_arbitrated = port.arbitrated;
      for (const auto& rule : port.rules) known.sources.push_back(rule.source);
    }
    return ports;
  }

  // Each once.
  static std::vector<const CompiledPort*> ports_of(const std::vector<Term>& terms) {
    std::vector<const CompiledPort*> ports;
    for (const Term& term : terms) {
      for (const auto* port : {term.port, term.other}) {
        const bool is_new = std::find(ports.begin(), ports.end(), port) == ports.end();
        if (port != nullptr && is_new) ports.push_back(port);
      }
    }
    return ports;
  }

  [[nodiscard]] Term term_of(const WinnerTerm& term) const {
    const CompiledPort& port = *ports_.at(term.port.name);
    Term result{&port};
    if (term.other_port) {
      result.other = ports_.at(term.other_port->name);
    } else if (!term.source && !term.pattern) {
      result.nobody = true;
    } else {
      for (const auto& rule : port.rules) {
        const bool may_win = term.source ? rule.source == term.source->name
                                         : matches(term.pattern->name, rule.source);
        if (may_win) result.rules.push_back(&rule);
      }
    }
    return result;
  }

  Diagnostics& diagnostics_;
  Budget& budget_;
  QuantifierExpansion expansion_;
  StatementNames names_;
  std::map<std::string, const CompiledPort*> ports_;
  std::vector<Case> cases_;
  std::map<std::set<std::string>, std::set<std::string>> read_with_;  // by ports
  std::optional<SharedScene> shared_;                                 // of these ports and sources
  std::set<std::string> scene_ports_;
  std::set<std::string> scene_sources_;
};

Subject about(const Verdict& verdict) {
  return {.ports = verdict.ports, .statement = verdict.statement, .winners = verdict.winners};
}

std::string in_words(const Verdict& verdict) {
  std::string text = "this is false with " + in_words(*verdict.witness);
  if (verdict.winners.empty()) return text + ", whatever else is";
  const char* separator = "; ";
  text += ", whatever else is";
  for (const auto& [port, winner] : verdict.winners) {
    text += separator + winner.value_or("nobody") + " wins at " + port;
    separator = ", ";
  }
  return text + " if nothing else is active";
}

}  // namespace

std::vector<Verdict> judge(const std::vector<Statement>& statements, const CompiledModel& model,
                           Diagnostics& diagnostics, Budget& budget) {
  return Judge(model, diagnostics, budget).judge(statements);
}

bool speaks_of(const ProvedStatement& statement, const CompiledPort& port) {
  return std::any_of(statement.terms.begin(), statement.terms.end(),
                     [&](const Term& term) { return term.port == &port || term.other == &port; });
}

void add_sources(const ProvedStatements& statements, SourceOrder& order) {
  std::set<const CompiledPort*> ports;  // orders are costly: each once
  std::set<std::string> sources;
  std::set<const Expression*> seen;
  for (const auto& statement : statements) {
    for (const Term& term : statement->terms) {
      for (const CompiledPort* port : {term.port, term.other}) {
        if (port != nullptr && ports.insert(port).second) order.add(*port);
      }
    }
    add_sources_of(*statement->expression, sources, seen);
  }
  for (const std::string& source : sources) {
    if (!source.starts_with('=')) order.add(source);
  }
}

Diagram allowed_by(const ProvedStatement& statement, Winners& winners, const CompiledPort& port,
                   const CompiledRule& rule, const Diagram& states) {
  Scene scene(winners);
  Question question(*statement.expression, statement.terms, scene);
  return winners.combine(Connective::kAnd, states, question.if_it_won(port, rule));
}

void report(const std::vector<Verdict>& verdicts, Diagnostics& diagnostics, bool with_proved) {
  for (const auto& verdict : verdicts) {
    if (verdict.kind == Verdict::Kind::kRefuted) {
      diagnostics.error("refuted", verdict.where,
                        in_words(verdict) +
                            "; change the model so that this state is decided otherwise, or the "
                            "statement if it says too much",
                        about(verdict), verdict.witness);
    } else if (verdict.kind == Verdict::Kind::kOpen) {
      diagnostics.error("left-open", verdict.where,
                        "neither proved nor refuted: it takes " + verdict.limit +
                            "; make several statements of it, about fewer ports each, or allow "
                            "more steps with --effort",
                        about(verdict));
    } else if (with_proved) {
      diagnostics.note("proved", verdict.where, "true in every state: " + verdict.statement,
                       about(verdict));
    }
  }
}

}  // namespace arbiter::rules
