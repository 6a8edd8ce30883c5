#include "watch/live_statement.hpp"

#include <algorithm>
#include <utility>

#include "rules/explain/tenure.hpp"
#include "rules/model/quantifiers.hpp"
#include "rules/model/statement_names.hpp"

namespace arbiter::watch {
namespace {

using rules::Truth;

// Where models change faster than one can be looked at.
constexpr int kMostModels = 5;

std::vector<shm::SourceId> sources_connected(const shm::TableView& table, shm::PortId port) {
  std::vector<shm::SourceId> sources;
  const auto range = table.connections_to(port);
  for (auto index = range.first; index != range.first + range.count; ++index) {
    sources.push_back(table.rule(index).source);
  }
  return sources;
}

// What the model in force has. All names must have come.
rules::StatementNames::Ports ports_of(const Instance& instance, const shm::TableView& table) {
  rules::StatementNames::Ports ports;
  for (const auto& [id, name] : instance.port_names()) {
    if (!table.knows_port(id)) continue;
    auto& port = ports[name];
    port.is_arbitrated = table.is_arbitrated(id);
    for (const shm::SourceId source : sources_connected(table, id)) {
      port.sources.push_back(instance.memory()->source_name(source));
    }
  }
  return ports;
}

}  // namespace

LiveStatement::LiveStatement(std::shared_ptr<Instance> instance, rules::Statement statement)
    : instance_(std::move(instance)), statement_(std::move(statement)) {}

LiveStatement::Look LiveStatement::look() {
  for (int i = 0; i < kMostModels; ++i) {
    if (!is_bound() && !bind()) break;
    Look look;
    look.picture = take_picture(*memory_, [this](const shm::TableView&) { return read_; });
    if (look.picture.snapshot.generation != generation_) continue;
    if (look.picture.is_settled) {
      look.truth = evaluate(look.picture);
      describe(look);
    }
    if (memory_->tables().is_whole(look.picture.snapshot)) return look;
  }
  return {};
}

bool LiveStatement::is_bound() const {
  return memory_ != nullptr && memory_ == instance_->memory() &&
         memory_->tables().generation() == generation_;
}

// False: nobody tells the names of this model now, or it is not in force any more.
bool LiveStatement::bind() {
  if (!instance_->has_daemon()) return false;
  try {
    instance_->catch_up();
  } catch (const wire::RefusedError&) {
    throw;
  } catch (const wire::CallError&) {  // it has gone, is stopped, or is busy: another time
    return false;
  }
  memory_.reset();  // nothing is bound if this fails
  const auto memory = instance_->memory();
  const auto snapshot = memory->tables().snapshot();
  if (snapshot.generation == 0) {
    throw WatchError(
        "no model is in force, so the condition can never become true; start arbiterd with "
        "--model FILE");
  }
  bind_names(snapshot.table);
  if (!memory->tables().is_whole(snapshot)) return false;
  if (diagnostics_.has_errors()) {
    throw StatementError("model " + std::to_string(snapshot.generation) +
                             ", which is in force, gives this condition no meaning",
                         std::exchange(diagnostics_, {}));
  }
  memory_ = memory;
  generation_ = snapshot.generation;
  return true;
}

void LiveStatement::bind_names(const shm::TableView& table) {
  diagnostics_ = {};
  terms_.clear();
  sources_.clear();
  ports_.clear();
  read_.clear();
  std::map<std::string, shm::SourceId> ids;
  std::vector<std::string> names;
  for (const shm::SourceId source : all_sources(table)) {
    ids[instance_->memory()->source_name(source)] = source;
  }
  names.reserve(ids.size());
  for (const auto& [name, id] : ids) names.push_back(name);
  rules::StatementNames known(names, ports_of(*instance_, table));
  if (!known.admit(statement_, diagnostics_)) return;
  expression_ = rules::QuantifierExpansion(names).expand(statement_.parsed.expression);
  std::set<shm::SourceId> read;
  for (const auto& term : statement_.parsed.terms) {
    terms_.push_back(bind_term(table, term));
    for (const auto* mention : {&term.port, term.other_port ? &*term.other_port : &term.port}) {
      ports_[mention->name] = *instance_->find_port(mention->name);
    }
  }
  for (const auto& [name, port] : ports_) {
    const auto heeded = rules::sources_heeded(table, port);
    read.insert(heeded.begin(), heeded.end());
  }
  std::set<std::string> mentioned;
  std::set<const rules::Expression*> seen;
  rules::add_sources_of(*expression_, mentioned, seen);
  for (const std::string& name : mentioned) {
    if (const auto found = ids.find(name); found != ids.end()) sources_.insert(*found);
  }
  for (const auto& [name, source] : sources_) read.insert(source);
  read_.assign(read.begin(), read.end());
}

LiveStatement::Term LiveStatement::bind_term(const shm::TableView& table,
                                             const rules::WinnerTerm& term) const {
  Term bound{*instance_->find_port(term.port.name)};
  if (term.other_port) {
    bound.other = instance_->find_port(term.other_port->name);
    return bound;
  }
  bound.nobody = !term.source && !term.pattern;
  for (const shm::SourceId source : sources_connected(table, bound.port)) {
    const std::string& name = instance_->memory()->source_name(source);
    const bool may_win = (term.source && term.source->name == name) ||
                         (term.pattern && rules::matches(term.pattern->name, name));
    if (may_win) bound.sources.insert(source);
  }
  return bound;
}

Truth LiveStatement::evaluate(const Picture& picture) const {
  rules::Evaluation evaluation([&](const std::string& name) {
    if (name.starts_with('=')) return evaluate(terms_.at(std::stoul(name.substr(1))), picture);
    const shm::SourceId source = sources_.at(name);
    return sees(*memory_, picture, source) ? rules::truth(picture.is_active(source))
                                           : Truth::kUnknown;
  });
  return evaluation.of(*expression_);
}

Truth LiveStatement::evaluate(const Term& term, const Picture& picture) const {
  if (!sees_port(*memory_, picture, term.port)) return Truth::kUnknown;
  const shm::SourceId winner = picture.winner_at(term.port);
  if (term.other) {
    if (!sees_port(*memory_, picture, *term.other)) return Truth::kUnknown;
    return rules::truth(winner == picture.winner_at(*term.other));
  }
  return rules::truth(term.nobody ? winner == shm::kNone : term.sources.contains(winner));
}

void LiveStatement::describe(Look& look) const {
  for (const auto& [name, port] : ports_) {
    if (!sees_port(*memory_, look.picture, port)) continue;
    const shm::SourceId winner = look.picture.winner_at(port);
    look.winners[name] =
        winner == shm::kNone ? std::nullopt : std::optional(memory_->source_name(winner));
  }
  for (const auto& [name, source] : sources_) {
    if (sees(*memory_, look.picture, source)) look.active[name] = look.picture.is_active(source);
  }
}

}  // namespace arbiter::watch
