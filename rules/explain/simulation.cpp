#include "rules/explain/simulation.hpp"

#include <algorithm>
#include <utility>

#include "rules/prove/flatten.hpp"
#include "rules/text/csv.hpp"

namespace arbiter::rules {
namespace {

std::vector<shm::Atomic<shm::Word>> make_table(
    const CompiledModel& model, const std::unordered_map<std::string, shm::SourceId>& source_ids) {
  std::unordered_map<std::string, shm::PortId> port_ids;
  for (const auto& port : model.ports) {
    port_ids.emplace(port.port, static_cast<shm::PortId>(port_ids.size()));
  }
  const auto words = flatten(model, {[&](const std::string& name) { return source_ids.at(name); },
                                     [&](const std::string& name) { return port_ids.at(name); }});
  std::vector<shm::Atomic<shm::Word>> table(words.size());
  for (std::size_t i = 0; i < words.size(); ++i) table[i] = words[i];
  return table;
}

std::unordered_map<std::string, shm::SourceId> number(const std::vector<std::string>& sources) {
  std::unordered_map<std::string, shm::SourceId> ids;
  for (const auto& source : sources) ids.emplace(source, static_cast<shm::SourceId>(ids.size()));
  return ids;
}

}  // namespace

Simulation::Simulation(const CompiledModel& model)
    : sources_(model.sources),
      ids_(number(model.sources)),
      words_(make_table(model, ids_)),
      table_(words_.data(), static_cast<shm::Word>(words_.size())),
      activity_(model.sources.size()),
      pages_(std::make_unique<shm::ActivityPages>()) {
  for (const auto& port : model.ports) ports_.push_back(port.port);
  for (std::size_t id = 0; id < activity_.size(); ++id) {
    pages_->attach(static_cast<shm::SourceId>(id), &activity_[id]);
  }
}

std::vector<shm::PortId> Simulation::ports_of(const TraceEvent& event) const {
  std::vector<shm::PortId> result;
  if (event.kind == TraceKind::kArrival) {
    if (!knows(event.source)) return result;
    const auto concerned = table_.ports_concerned(ids_.at(event.source));
    for (shm::Word i = 0; i < concerned.count; ++i) result.push_back(concerned[i]);
    return result;
  }
  for (shm::PortId port = 0; port < table_.port_count(); ++port) {
    if (table_.is_arbitrated(port)) result.push_back(port);
  }
  return result;
}

std::vector<OutcomeRow> Simulation::step(const TraceEvent& event) {
  apply(event);
  std::vector<OutcomeRow> rows;
  for (const shm::PortId port : ports_of(event)) {
    rows.push_back({event, ports_[port], outcome_at(port, event)});
  }
  return rows;
}

void Simulation::apply(const TraceEvent& event) {
  clock_.now = event.at;
  if (event.kind == TraceKind::kTick || !knows(event.source)) return;
  const shm::SourceId source = ids_.at(event.source);
  shm::Activity& activity = activity_[source];
  if (event.kind == TraceKind::kDeactivation) {
    activity.deactivate(event.at);
  } else {
    activity.write(shm::arrival(event.at, table_.timeout(source)), !is_active(source), event.at);
  }
}

PortOutcome Simulation::outcome_at(shm::PortId port, const TraceEvent& event) {
  PortOutcome outcome;
  if (event.kind == TraceKind::kArrival) {
    const shm::ConnectionIndex connection = table_.find(ids_.at(event.source), port);
    outcome.delivered = connection != shm::kNone && is_delivered(table_.rule(connection));
  }
  const shm::SourceId winner = winner_at(port);
  if (winner != shm::kNone) outcome.winner = sources_[winner];
  return outcome;
}

bool Simulation::is_delivered(const shm::Rule& rule) {
  shm::Decider decider(table_, *pages_, clock_);
  return decider.decide(rule) == shm::Verdict::kWins;
}

std::optional<shm::PortId> Simulation::find_port(const std::string& port) const {
  const auto found = std::lower_bound(ports_.begin(), ports_.end(), port);
  if (found == ports_.end() || *found != port) return std::nullopt;
  return static_cast<shm::PortId>(found - ports_.begin());
}

shm::SourceId Simulation::winner_at(shm::PortId port) const {
  const auto active = [this](shm::SourceId source) { return is_active(source); };
  return shm::selected_at(table_, port, active).source;
}

void write_outcome_header(std::ostream& out) { out << "t_ns,source,destination,decision,winner\n"; }

void write_outcome(std::ostream& out, const OutcomeRow& row) {
  const TraceEvent& event = row.event;
  const std::string& hindrance = row.outcome.hindrance;
  const std::string decision = !hindrance.empty()      ? hindrance
                               : row.outcome.delivered ? "delivered"
                                                       : "discarded";
  out << event.at << ',' << (event.kind == TraceKind::kTick ? "-" : to_csv(event.source)) << ','
      << to_csv(row.port) << ',' << (event.kind == TraceKind::kArrival ? decision : "-") << ','
      << (row.outcome.winner.empty() ? "-" : to_csv(row.outcome.winner)) << '\n';
}

}  // namespace arbiter::rules
