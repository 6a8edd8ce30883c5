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
  std::vector<const CompiledRule*> rules{};  // of which one wins
  bool nobody = false;                       // in place of these: nobody wins
  const CompiledPort* other = nullptr;       // in place of both: the winner is the same there
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
    // That nobody wins, or the same as elsewhere, needs all rules of a port in one diagram. Where
    // that is too large, each possible winner is looked at by itself.
    try {
      return ask(false);
    } catch (const DiagramLimit&) {
      if (whole_.empty()) throw;
    }
    return ask(true);
  }

 private:
  void gather() {
    for (const Term& term : terms_) {
      order_.add(*term.port);
      if (term.other != nullptr) order_.add(*term.other);
    }
    add_sources(expression_);
    for (const Term& term : terms_) {
      if (term.nobody || term.other != nullptr) add_whole(*term.port);
      if (term.other != nullptr) add_whole(*term.other);
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

  void add_whole(const CompiledPort& port) {
    if (std::find(whole_.begin(), whole_.end(), &port) == whole_.end()) whole_.push_back(&port);
  }

  void add_sources(const Expression& expression) {
    if (expression.op == Operator::kSource && !expression.name.starts_with('=')) {
      order_.add(expression.name);
    }
    for (const auto& operand : expression.operands) add_sources(*operand);
  }

  // The winner at each port of whole_ is chosen in turn; what is left of the statement then reads
  // few rules, and most often contradicts `state` at once.
  Diagram refute_by_cases(std::size_t next, const Diagram& state) {
    if (next == whole_.size()) {
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
    const CompiledPort* port = whole_[next];
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
    if (term.other != nullptr) return build_same(*term.port, *term.other);
    if (const auto known = decided_.find(term.port); known != decided_.end()) {
      const auto* const winner = known->second;
      const auto& rules = term.rules;
      return winners_->constant(term.nobody
                                    ? winner == nullptr
                                    : std::find(rules.begin(), rules.end(), winner) != rules.end());
    }
    Diagram result = winners_->constant(term.nobody);
    if (term.nobody) {
      for (const auto& rule : term.port->rules) {
        result = winners_->combine(Connective::kAndNot, result, winners_->holds(rule));
      }
    }
    for (const auto* rule : term.rules) {
      result = winners_->combine(Connective::kOr, result, winners_->winner(*term.port, *rule));
    }
    return result;
  }

  // Each source wins at both or at neither: since only one can win at each, that is the same
  // winner.
  Diagram build_same(const CompiledPort& port, const CompiledPort& other) {
    std::set<std::string> sources;
    for (const auto* each : {&port, &other}) {
      for (const auto& rule : each->rules) sources.insert(rule.source);
    }
    Diagram same = winners_->constant(true);
    for (const auto& source : sources) {
      const Diagram differ =
          winners_->combine(Connective::kXor, wins_at(port, source), wins_at(other, source));
      same = winners_->combine(Connective::kAndNot, same, differ);
    }
    return same;
  }

  Diagram wins_at(const CompiledPort& port, const std::string& source) {
    if (const auto known = decided_.find(&port); known != decided_.end()) {
      return winners_->constant(known->second != nullptr && known->second->source == source);
    }
    for (const auto& rule : port.rules) {
      if (rule.source == source) return winners_->winner(port, rule);
    }
    return winners_->constant(false);
  }

  const Expression& expression_;
  const std::vector<Term> terms_;
  const std::uint64_t max_work_;
  SourceOrder order_;
  std::vector<const CompiledPort*> whole_;  // of which it takes all rules to tell
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
    statement_ = &statement;
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
    const auto ports = ports_of(terms);
    for (const auto* port : ports) verdict.ports.push_back(port->port);
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
    for (const auto* port : ports) {
      const CompiledRule* winner = find_winner(*port, active);
      verdict.winners.emplace_back(
          port->port, winner == nullptr ? std::nullopt : std::optional(winner->source));
    }
    return verdict;
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

  std::optional<Term> find_term(const WinnerTerm& term) {
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
  const CompiledPort* find_port(const Mention& mention) {
    const auto port = ports_.find(mention.name);
    if (port == ports_.end()) {
      std::vector<std::string_view> names;
      for (const auto& [name, known] : ports_) names.push_back(name);
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
  const CompiledRule* find_rule(const CompiledPort& port, const Mention& source) {
    std::vector<std::string_view> names;
    for (const auto& rule : port.rules) {
      if (rule.source == source.name) return &rule;
      names.push_back(rule.source);
    }
    report("not-connected", source,
           source.name + " is not connected to " + port.port + ", so that it can never win there" +
               advise(source.name, names, "name one of its connections"),
           {.ports = {port.port}, .source = source.name});
    return nullptr;
  }

  std::vector<const CompiledRule*> find_rules(const CompiledPort& port, const Mention& pattern) {
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

  void report(std::string code, const Mention& mention, std::string message, Subject about) {
    about.statement = statement_->text;
    diagnostics_.error(std::move(code), mention.where, std::move(message), std::move(about));
  }

  bool is_known(const Mention& source) {
    if (sources_.contains(source.name)) return true;
    const std::vector<std::string_view> names(sources_.begin(), sources_.end());
    const bool may_suggest = ++unknown_ <= kMaxSuggestions;
    report("unknown-source", source,
           "neither the model nor its application names a source " + source.name +
               (may_suggest ? advise(source.name, names, "name one that it reads or connects")
                            : std::string("; name one that it reads or connects")),
           {.source = source.name});
    return false;
  }

  void warn_if_unmatched(const Mention& glob) {
    const auto fits = [&](const auto& source) { return matches(glob.name, source); };
    if (std::any_of(sources_.begin(), sources_.end(), fits)) return;
    diagnostics_.warning("matches-nothing", glob.where,
                         "no source matches " + quote(glob.name) +
                             ": any() is false of it, all() and none() are true; correct it",
                         {.statement = statement_->text});
  }

  Diagnostics& diagnostics_;
  const std::uint64_t max_work_;
  QuantifierExpansion expansion_;
  std::set<std::string, std::less<>> sources_;
  std::map<std::string, const CompiledPort*> ports_;
  const Statement* statement_ = nullptr;  // the one that is judged
  std::size_t unknown_ = 0;
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
                        about(verdict), verdict.witness);
    } else if (verdict.kind == Verdict::Kind::kOpen) {
      diagnostics.error("left-open", verdict.where,
                        "neither proved nor refuted: it takes " + verdict.limit +
                            "; make several statements of it, about fewer ports each",
                        about(verdict));
    } else if (with_proved) {
      diagnostics.note("proved", verdict.where, "true in every state: " + verdict.statement,
                       about(verdict));
    }
  }
}

}  // namespace arbiter::rules
