#include "rules/verdict.hpp"

#include <algorithm>
#include <map>
#include <set>
#include <unordered_map>

#include "rules/compile_port.hpp"
#include "rules/names.hpp"
#include "rules/quantifiers.hpp"
#include "rules/winners.hpp"

namespace arbiter::rules {
namespace {

using Active = std::set<std::string>;

struct Term {
  const CompiledPort* port;
  const CompiledRule* rule;  // null: nobody wins
};

}  // namespace

struct ProvedStatement {
  ExpressionPtr expression;
  std::vector<Term> terms;
};

namespace {

// One statement about one model.
class Question {
 public:
  Question(const Expression& expression, std::vector<Term> terms, std::uint64_t max_work)
      : expression_(expression), terms_(std::move(terms)), max_work_(max_work) {}

  // The states in which the statement is true if that rule's source wins at the port.
  Diagram if_it_won(Winners& winners, const CompiledPort& port, const CompiledRule& rule) {
    winners_ = &winners;
    decided_ = {{&port, &rule}};
    const Forget forget{*this};
    return build(expression_);
  }

  // A witness against the statement, if there is one. Throws DiagramLimit.
  std::optional<Witness> refute() {
    gather();
    // That nobody wins is the only function that needs all rules of a port in one diagram. Where
    // that is too large, each possible winner is looked at by itself.
    try {
      return ask(false);
    } catch (const DiagramLimit&) {
      if (idle_.empty()) throw;
    }
    return ask(true);
  }

 private:
  void gather() {
    for (const Term& term : terms_) order_.add(*term.port);
    add_sources(expression_);
    for (const Term& term : terms_) {
      const bool is_new = std::find(idle_.begin(), idle_.end(), term.port) == idle_.end();
      if (term.rule == nullptr && is_new) idle_.push_back(term.port);
    }
  }

  std::optional<Witness> ask(bool by_cases) {
    std::optional<Witness> witness;
    try {
      Winners winners(order_, max_work_);
      winners_ = &winners;
      const Diagram bad = by_cases ? refute_by_cases(0, winners.constant(true))
                                   : winners.negate(build(expression_));
      if (!bad.is_false()) witness = winners.witness(bad);
    } catch (...) {
      forget();
      throw;
    }
    forget();
    return witness;
  }

  struct Forget {
    Question& question;
    ~Forget() { question.forget(); }
  };

  void forget() {  // diagrams must not outlive their builder
    built_.clear();
    decided_.clear();
    winners_ = nullptr;
  }

  void add_sources(const Expression& expression) {
    if (expression.op == Operator::kSource && !expression.name.starts_with('=')) {
      order_.add(expression.name);
    }
    for (const auto& operand : expression.operands) add_sources(*operand);
  }

  // The winner at each port of idle_ is chosen in turn; what is left of the statement then reads
  // few rules, and most often contradicts `state` at once.
  Diagram refute_by_cases(std::size_t next, const Diagram& state) {
    if (next == idle_.size()) {
      Diagram bad = winners_->combine(Connective::kAndNot, state, build(expression_));
      built_.clear();
      for (const auto& [port, winner] : decided_) {
        if (winner != nullptr) continue;
        for (const auto& rule : port->rules) {
          if (bad.is_false()) return bad;
          bad = winners_->combine(Connective::kAndNot, bad, winners_->holds(rule));
        }
      }
      return bad;
    }
    const CompiledPort* port = idle_[next];
    decided_[port] = nullptr;
    Diagram bad = refute_by_cases(next + 1, state);
    for (const auto& rule : port->rules) {
      if (!bad.is_false()) break;
      const Diagram wins =
          winners_->combine(Connective::kAnd, state, winners_->winner(*port, rule));
      if (wins.is_false()) continue;
      decided_[port] = &rule;
      bad = refute_by_cases(next + 1, wins);
    }
    decided_.erase(port);
    return bad;
  }

  Diagram build(const Expression& expression) {
    if (const auto known = built_.find(&expression); known != built_.end()) return known->second;
    Diagram result = build_new(expression);
    built_.emplace(&expression, result);
    return result;
  }

  Diagram build_new(const Expression& expression) {
    const auto& operands = expression.operands;
    switch (expression.op) {
      case Operator::kFalse:
      case Operator::kTrue:
        return winners_->constant(expression.op == Operator::kTrue);
      case Operator::kSource:
        if (!expression.name.starts_with('=')) return winners_->active(expression.name);
        return build_term(terms_.at(std::stoul(expression.name.substr(1))));
      case Operator::kNot:
        return winners_->negate(build(*operands[0]));
      case Operator::kAnd:
      case Operator::kOr: {
        Diagram result = winners_->constant(expression.op == Operator::kAnd);
        for (std::size_t i = operands.size(); i-- > 0;) {
          result = winners_->combine(connective_of(expression.op), result, build(*operands[i]));
        }
        return result;
      }
      default: {
        const Diagram left = build(*operands[0]);
        return winners_->combine(connective_of(expression.op), left, build(*operands[1]));
      }
    }
  }

  Diagram build_term(const Term& term) {
    if (const auto known = decided_.find(term.port); known != decided_.end()) {
      return winners_->constant(known->second == term.rule);
    }
    if (term.rule != nullptr) return winners_->winner(*term.port, *term.rule);
    Diagram idle = winners_->constant(true);
    for (const auto& rule : term.port->rules) {
      idle = winners_->combine(Connective::kAndNot, idle, winners_->holds(rule));
    }
    return idle;
  }

  const Expression& expression_;
  const std::vector<Term> terms_;
  const std::uint64_t max_work_;
  SourceOrder order_;
  std::vector<const CompiledPort*> idle_;  // of which the statement says that nobody wins
  Winners* winners_ = nullptr;
  std::unordered_map<const Expression*, Diagram> built_;
  std::map<const CompiledPort*, const CompiledRule*> decided_;  // null: nobody wins
};

class Judge {
 public:
  Judge(const CompiledModel& model, Diagnostics& diagnostics, std::uint64_t max_work)
      : diagnostics_(diagnostics),
        max_work_(max_work),
        expansion_(model.sources),
        sources_(model.sources.begin(), model.sources.end()) {
    for (const auto& port : model.ports) ports_.emplace(port.port, &port);
  }

  std::optional<Verdict> judge(const Statement& statement) {
    bool has_meaning = true;
    std::vector<Term> terms;
    for (const auto& term : statement.parsed.terms) {
      const auto found = find_term(term);
      has_meaning = has_meaning && found.has_value();
      if (found) terms.push_back(*found);
    }
    for (const auto& source : statement.parsed.sources) {
      has_meaning = is_known(source) && has_meaning;
    }
    for (const auto& glob : statement.parsed.globs) warn_if_unmatched(glob);
    if (!has_meaning) return std::nullopt;
    return decide(statement, terms);
  }

 private:
  Verdict decide(const Statement& statement, const std::vector<Term>& terms) {
    Verdict verdict;
    verdict.statement = statement.text;
    verdict.where = statement.where;
    const ExpressionPtr expression = expansion_.expand(statement.parsed.expression);
    try {
      verdict.witness = Question(*expression, terms, max_work_).refute();
    } catch (const DiagramLimit& limit) {
      verdict.kind = Verdict::Kind::kOpen;
      verdict.limit = limit.what();
      return verdict;
    }
    if (!verdict.witness) {
      verdict.proved = std::make_shared<const ProvedStatement>(ProvedStatement{expression, terms});
      return verdict;
    }
    verdict.kind = Verdict::Kind::kRefuted;
    const Active active(verdict.witness->active.begin(), verdict.witness->active.end());
    std::set<std::string> seen;
    for (const Term& term : terms) {
      if (!seen.insert(term.port->port).second) continue;
      const CompiledRule* winner = find_winner(*term.port, active);
      verdict.winners.emplace_back(
          term.port->port, winner == nullptr ? std::nullopt : std::optional(winner->source));
    }
    return verdict;
  }

  std::optional<Term> find_term(const WinnerTerm& term) {
    const auto port = ports_.find(term.port.name);
    if (port == ports_.end()) {
      std::vector<std::string_view> names;
      for (const auto& [name, known] : ports_) names.push_back(name);
      diagnostics_.error("unknown-port", term.port.where,
                         "the model has no input port " + term.port.name +
                             advise(term.port.name, names, "name one that is arbitrated"));
      return std::nullopt;
    }
    if (!port->second->arbitrated) {
      diagnostics_.error("not-arbitrated", term.port.where,
                         "no rule mentions " + term.port.name +
                             ": it is not arbitrated, everything is delivered there and nobody "
                             "wins or loses; name a port that is arbitrated");
      return std::nullopt;
    }
    if (!term.source) return Term{port->second, nullptr};
    std::vector<std::string_view> names;
    for (const auto& rule : port->second->rules) {
      if (rule.source == term.source->name) return Term{port->second, &rule};
      names.push_back(rule.source);
    }
    diagnostics_.error("not-connected", term.source->where,
                       term.source->name + " is not connected to " + term.port.name +
                           ", so that it can never win there" +
                           advise(term.source->name, names, "name one of its connections"));
    return std::nullopt;
  }

  bool is_known(const Mention& source) {
    if (sources_.contains(source.name)) return true;
    const std::vector<std::string_view> names(sources_.begin(), sources_.end());
    const bool may_suggest = ++unknown_ <= kMaxSuggestions;
    diagnostics_.error(
        "unknown-source", source.where,
        "neither the model nor its application names a source " + source.name +
            (may_suggest ? advise(source.name, names, "name one that it reads or connects")
                         : std::string("; name one that it reads or connects")));
    return false;
  }

  void warn_if_unmatched(const Mention& glob) {
    const auto fits = [&](const auto& source) { return matches(glob.name, source); };
    if (std::any_of(sources_.begin(), sources_.end(), fits)) return;
    diagnostics_.warning("matches-nothing", glob.where,
                         "no source matches " + quote(glob.name) +
                             ": any() is false of it, all() and none() are true; correct it");
  }

  Diagnostics& diagnostics_;
  const std::uint64_t max_work_;
  QuantifierExpansion expansion_;
  std::set<std::string, std::less<>> sources_;
  std::map<std::string, const CompiledPort*> ports_;
  std::size_t unknown_ = 0;
};

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
                           Diagnostics& diagnostics, std::uint64_t max_work) {
  Judge judge(model, diagnostics, max_work);
  std::vector<Verdict> verdicts;
  for (const auto& statement : statements) {
    if (auto verdict = judge.judge(statement)) verdicts.push_back(std::move(*verdict));
  }
  return verdicts;
}

bool speaks_of(const ProvedStatement& statement, const CompiledPort& port) {
  return std::any_of(statement.terms.begin(), statement.terms.end(),
                     [&](const Term& term) { return term.port == &port; });
}

void add_sources(const ProvedStatements& statements, SourceOrder& order) {
  std::set<const CompiledPort*> ports;  // orders are costly: each once
  std::set<std::string> sources;
  std::set<const Expression*> seen;
  for (const auto& statement : statements) {
    for (const Term& term : statement->terms) {
      if (ports.insert(term.port).second) order.add(*term.port);
    }
    add_sources_of(*statement->expression, sources, seen);
  }
  for (const std::string& source : sources) {
    if (!source.starts_with('=')) order.add(source);
  }
}

Diagram allowed_by(const ProvedStatement& statement, Winners& winners, const CompiledPort& port,
                   const CompiledRule& rule, const Diagram& states) {
  Question question(*statement.expression, statement.terms, Winners::kMaxWork);
  return winners.combine(Connective::kAnd, states, question.if_it_won(winners, port, rule));
}

void report(const std::vector<Verdict>& verdicts, Diagnostics& diagnostics, bool with_proved) {
  for (const auto& verdict : verdicts) {
    if (verdict.kind == Verdict::Kind::kRefuted) {
      diagnostics.error("refuted", verdict.where,
                        in_words(verdict) +
                            "; change the model so that this state is decided otherwise, or the "
                            "statement if it says too much",
                        verdict.witness);
    } else if (verdict.kind == Verdict::Kind::kOpen) {
      diagnostics.error("left-open", verdict.where,
                        "neither proved nor refuted: it takes " + verdict.limit +
                            "; make several statements of it, about fewer ports each");
    } else if (with_proved) {
      diagnostics.note("proved", verdict.where, "true in every state: " + verdict.statement);
    }
  }
}

}  // namespace arbiter::rules
