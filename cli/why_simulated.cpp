#include "cli/why_simulated.hpp"

#include <algorithm>
#include <cstdio>
#include <stdexcept>
#include <string_view>

#include "cli/model_report.hpp"
#include "cli/port_name.hpp"
#include "rules/explain/change.hpp"
#include "rules/explain/tenure.hpp"
#include "rules/text/names.hpp"

namespace arbiter::cli {
namespace {

using nlohmann::json;

// Milliseconds, and what is finer only where it is there: "0.100 s", "0.100000001 s".
std::string time_text(shm::Nanoseconds time) {
  char text[64];
  std::snprintf(text, sizeof text, "%lld.%09lld", static_cast<long long>(time / 1'000'000'000),
                static_cast<long long>(time % 1'000'000'000));
  std::string result = text;
  const std::size_t shortest = result.find('.') + 4;
  while (result.size() > shortest && result.back() == '0') result.pop_back();
  return result + " s";
}

}  // namespace

WhySimulated::WhySimulated(const rules::RuleSet& rules, rules::Simulation& simulation,
                           Options options)
    : explainer_(rules),
      simulation_(simulation),
      options_(std::move(options)),
      winners_(simulation.port_names().size(), shm::kNone),
      was_active_(simulation.source_count(), false) {
  if (!options_.port.empty()) require_port(rules, options_.port, kWhyOption);
}

void WhySimulated::step(const rules::TraceEvent& event, std::ostream& out) {
  run_out_until(event.at, out);
  const auto rows = simulation_.step(event);
  if (simulation_.knows(event.source)) schedule(simulation_.source_id(event.source));
  tell_changes(out);
  if (event.kind != rules::TraceKind::kArrival) return;
  for (const auto& row : rows) {
    if (!row.outcome.delivered) tell_discarded(row, out);
  }
}

void WhySimulated::run_out_until(shm::Nanoseconds time, std::ostream& out) {
  while (!ends_.empty() && ends_.begin()->first <= time) {
    simulation_.advance_to(ends_.begin()->first);
    // All that ends at this moment ends at once.
    while (!ends_.empty() && ends_.begin()->first == simulation_.now()) ends_.erase(ends_.begin());
    tell_changes(out);
  }
  if (time > options_.from) tell_held(out);
}

void WhySimulated::end(shm::Nanoseconds time, std::ostream& out) {
  run_out_until(time, out);
  tell_repeats(out);
  if (time >= options_.from) tell_held(out);
}

void WhySimulated::end_by_model(const evidence::ModelChange& model, shm::Nanoseconds time,
                                const std::function<bool(const std::string& port)>& has_winner,
                                std::ostream& out) {
  run_out_until(time, out);
  tell_repeats(out);
  simulation_.advance_to(time);
  for (shm::PortId port = 0; port < winners_.size(); ++port) {
    const std::string& name = simulation_.port_name(port);
    const bool is_wanted = options_.port.empty() || options_.port == name;
    if (winners_[port] == shm::kNone || !is_wanted || has_winner(name)) continue;
    const std::string winner = name_of(winners_[port]);
    if (options_.json) {
      const json event{{"t_ns", time},         {"port", name},
                       {"event", "change"},    {"old", winner},
                       {"winner", nullptr},    {"because", json::array()},
                       {"old_loses", nullptr}, {"model", model.generation}};
      tell(port, line_of(event, time), out);
    } else {
      std::string line = text_of(time) + "  " + name + "  ";
      line += winner + " -> idle  because " + news_text(model) + '\n';
      tell(port, std::move(line), out);
    }
  }
  if (time > options_.from) tell_held(out);
}

std::string WhySimulated::line_of(json event, shm::Nanoseconds time) const {
  if (options_.clock) event["time"] = options_.clock(time);
  return event.dump(-1, ' ', false, json::error_handler_t::replace) + '\n';
}

void WhySimulated::tell(shm::PortId port, std::string line, std::ostream& out) {
  const shm::Nanoseconds now = simulation_.now();
  if (now >= options_.to) return;
  if (now > options_.from) tell_held(out);
  std::erase_if(held_, [&](const Held& each) { return each.port == port; });
  held_.push_back({port, std::move(line)});
  if (now >= options_.from) tell_held(out);
}

void WhySimulated::tell_held(std::ostream& out) {
  for (const Held& each : held_) out << each.line;
  has_told_ = has_told_ || !held_.empty();
  held_.clear();
}

void WhySimulated::begin(std::ostream& out) {
  for (shm::SourceId source = 0; source < was_active_.size(); ++source) {
    was_active_[source] = simulation_.is_active(source);
    schedule(source);
  }
  for (shm::PortId port = 0; port < winners_.size(); ++port) {
    if (!simulation_.table().is_arbitrated(port)) continue;
    winners_[port] = simulation_.winner_at(port);
    const std::string& name = simulation_.port_name(port);
    const bool is_wanted = options_.port.empty() || options_.port == name;
    if (winners_[port] == shm::kNone || !is_wanted) continue;
    if (options_.json) {
      const json event{{"t_ns", simulation_.now()},
                       {"port", name},
                       {"event", "begin"},
                       {"winner", name_of(winners_[port])}};
      tell(port, line_of(event, simulation_.now()), out);
    } else {
      tell(port,
           time_of_now() + "  " + name + "  " + name_of(winners_[port]) + " wins as this begins\n",
           out);
    }
  }
}

void WhySimulated::find(const std::string& source, shm::ActivityWord word, shm::Nanoseconds time,
                        std::ostream& out) {
  run_out_until(time, out);
  simulation_.advance_to(time);
  if (!simulation_.knows(source)) return;
  const shm::SourceId id = simulation_.source_id(source);
  simulation_.set_activity(id, word);
  schedule(id);
  tell_changes(out);
}

void WhySimulated::lose(const std::string& source, std::uint64_t events, shm::Nanoseconds from,
                        shm::Nanoseconds to, std::ostream& out) {
  run_out_until(from, out);
  if (!simulation_.knows(source)) return;
  const auto ports = simulation_.table().ports_concerned(simulation_.source_id(source));
  bool is_wanted = false;
  for (shm::Word i = 0; i < ports.count; ++i) {
    is_wanted |= options_.port.empty() || options_.port == simulation_.port_name(ports[i]);
  }
  if (!is_wanted || to <= options_.from || from >= options_.to) return;
  std::string line;
  if (options_.json) {
    line = line_of({{"t_ns", from},
                    {"event", "missed"},
                    {"source", source},
                    {"events", events},
                    {"until_ns", to}},
                   from);
  } else {
    line = text_of(from) + "  the recorder missed " + rules::counted(events, "event") + " of " +
           source + " from here until " + text_of(to) + ": what depends on it is not known\n";
  }
  held_.push_back({shm::kNone, std::move(line)});
  if (from >= options_.from) tell_held(out);
}

// An end that a renewal has put off is looked at in vain.
void WhySimulated::schedule(shm::SourceId source) {
  const shm::ActivityWord word = simulation_.activity(source);
  if (shm::is_finite(word) && simulation_.is_active(source)) ends_.emplace(word, source);
}

std::string WhySimulated::text_of(shm::Nanoseconds time) const {
  return options_.time ? options_.time(time) : time_text(time);
}

bool WhySimulated::is_in_gap(const std::string& source) const {
  return options_.is_in_gap && options_.is_in_gap(source, simulation_.now());
}

// Behind what was missed, nobody knows when it became so; an end within may not have been one.
std::string WhySimulated::cause_text(const std::string& source, const Sources& sources) const {
  const SourceState state = sources.state(source);
  if (!is_in_gap(source)) return event_text(source, state, simulation_.now());
  if (shm::is_deactivation(state.word)) return source + " was deactivated in what was missed";
  return shm::is_active(state.word, simulation_.now())
             ? source + " is active behind what was missed"
             : source + " went inactive, unless it arrived in what was missed";
}

void WhySimulated::tell_changes(std::ostream& out) {
  std::set<shm::PortId> concerned;
  for (shm::SourceId source = 0; source < was_active_.size(); ++source) {
    if (simulation_.is_active(source) == was_active_[source]) continue;
    const auto ports = simulation_.table().ports_concerned(source);
    for (shm::Word i = 0; i < ports.count; ++i) concerned.insert(ports[i]);
  }
  for (const shm::PortId port : concerned) {
    const shm::SourceId before = winners_[port];
    winners_[port] = simulation_.winner_at(port);
    if (winners_[port] != before) tell_change(port, before, winners_[port], out);
  }
  for (shm::SourceId source = 0; source < was_active_.size(); ++source) {
    was_active_[source] = simulation_.is_active(source);
  }
}

Sources WhySimulated::sources_at(shm::PortId port) const {
  Sources sources;
  sources.set_time(simulation_.now());
  for (const shm::SourceId source : rules::sources_heeded(simulation_.table(), port)) {
    sources.set(simulation_.source_name(source),
                {simulation_.activity(source), simulation_.table().timeout(source)});
  }
  return sources;
}

std::string WhySimulated::name_of(shm::SourceId winner) const {
  return winner == shm::kNone ? "idle" : simulation_.source_name(winner);
}

std::optional<rules::ConnectionExplanation> WhySimulated::explain(shm::PortId port,
                                                                  const std::string& source,
                                                                  const Sources& sources) const {
  return explainer_.explain_connection(
      simulation_.port_name(port), source,
      [&](const std::string& each) { return sources.is_active(each); });
}

std::string WhySimulated::loss_of(shm::SourceId before, shm::PortId port,
                                  const Sources& sources) const {
  if (before == shm::kNone || !simulation_.is_active(before)) return {};
  const auto loser = explain(port, simulation_.source_name(before), sources);
  return loser ? loss_text(*loser, sources) : "";
}

void WhySimulated::tell_change(shm::PortId port, shm::SourceId before, shm::SourceId now,
                               std::ostream& out) {
  const std::string& name = simulation_.port_name(port);
  if (!options_.port.empty() && options_.port != name) return;
  tell_repeats_at(port, out);
  if (simulation_.now() >= options_.to) return;
  const Sources sources = sources_at(port);
  const auto causes = rules::causes_of_change(
      simulation_.table(), port, [this](shm::SourceId source) { return was_active_[source]; },
      [this](shm::SourceId source) { return simulation_.is_active(source); });
  const std::string loss = loss_of(before, port, sources);
  if (options_.json) {
    json because = json::array();
    for (const shm::SourceId cause : causes) {
      const std::string& source = simulation_.source_name(cause);
      json event = event_json(source, sources.state(source), simulation_.now());
      if (is_in_gap(source)) event["is_in_gap"] = true;
      because.push_back(std::move(event));
    }
    const json event{{"t_ns", simulation_.now()},
                     {"port", name},
                     {"event", "change"},
                     {"old", before == shm::kNone ? json(nullptr) : json(name_of(before))},
                     {"winner", now == shm::kNone ? json(nullptr) : json(name_of(now))},
                     {"because", std::move(because)},
                     {"old_loses", loss.empty() ? json(nullptr) : json(loss)}};
    tell(port, line_of(event, simulation_.now()), out);
    return;
  }
  std::string line =
      time_of_now() + "  " + name + "  " + name_of(before) + " -> " + name_of(now) + "  because ";
  for (std::size_t i = 0; i < causes.size(); ++i) {
    const std::string& source = simulation_.source_name(causes[i]);
    line += (i == 0 ? "" : " and ") + cause_text(source, sources);
  }
  if (!loss.empty()) line += "; " + name_of(before) + " is " + loss;
  tell(port, line + '\n', out);
}

void WhySimulated::tell_discarded(const rules::OutcomeRow& row, std::ostream& out) {
  if (!options_.port.empty() && options_.port != row.port) return;
  if (row.event.at < options_.from || row.event.at >= options_.to) return;
  const auto& ports = simulation_.port_names();
  const auto port = static_cast<shm::PortId>(
      std::lower_bound(ports.begin(), ports.end(), row.port) - ports.begin());
  const Sources sources = sources_at(port);
  const auto connection = explain(port, row.event.source, sources);
  if (!connection) return;  // the port only reads it
  tell_held(out);
  has_told_ = true;
  if (options_.json) {
    const json event{{"t_ns", row.event.at},
                     {"port", row.port},
                     {"event", "discarded"},
                     {"connection", connection_json(*connection, sources)}};
    out << line_of(event, row.event.at);
  } else if (!count_repeat(port, *connection, out)) {
    out << time_of_now() << "  " << row.port << "  " << connection->source
        << " discarded: " << first_cause(*connection, sources) << '\n';
  }
}

bool WhySimulated::count_repeat(shm::PortId port, const rules::ConnectionExplanation& connection,
                                std::ostream& out) {
  std::string reason = first_cause(connection, Sources());  // without times
  const auto literals = connection.reason();
  for (const rules::Literal& each : literals.value_or(std::vector<rules::Literal>())) {
    reason += ' ' + each.source + (each.active ? '+' : '-');
  }
  const auto [known, is_new] = repeats_.try_emplace({port, connection.source});
  Repeats& repeats = known->second;
  if (!is_new && repeats.reason == reason) {
    ++repeats.more;
    repeats.last = simulation_.now();
    return true;
  }
  tell_repeats(known->first, repeats, out);
  repeats = {std::move(reason)};
  return false;
}

void WhySimulated::tell_repeats(const Connection& connection, const Repeats& repeats,
                                std::ostream& out) {
  if (repeats.more == 0) return;
  out << text_of(std::min(simulation_.now(), options_.to)) << "  "
      << simulation_.port_name(connection.first) << "  " << connection.second << " was discarded "
      << rules::counted(repeats.more, "more time") << " for that reason, until "
      << text_of(repeats.last) << '\n';
}

void WhySimulated::tell_repeats_at(shm::PortId port, std::ostream& out) {
  for (auto at = repeats_.lower_bound({port, ""}); at != repeats_.end() && at->first.first == port;
       at = repeats_.erase(at)) {
    tell_repeats(at->first, at->second, out);
  }
}

void WhySimulated::tell_repeats(std::ostream& out) {
  for (const auto& [connection, repeats] : repeats_) tell_repeats(connection, repeats, out);
  repeats_.clear();
}

}  // namespace arbiter::cli
