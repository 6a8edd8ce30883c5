#include "top/frame.hpp"

#include <algorithm>
#include <map>

#include "watch/imported.hpp"
#include "watch/process.hpp"

namespace arbiter::top {
namespace {

template <class Fact>
std::ptrdiff_t find(const std::vector<Fact>& facts, const std::string& name) {
  const auto found = std::lower_bound(
      facts.begin(), facts.end(), name,
      [](const Fact& fact, const std::string& wanted) { return fact.name < wanted; });
  return found == facts.end() || found->name != name ? -1 : found - facts.begin();
}

// Nothing: the counter has begun again in between.
std::optional<double> per_second(std::uint64_t before, std::uint64_t now, double seconds) {
  if (now < before || seconds <= 0) return std::nullopt;
  return static_cast<double>(now - before) / seconds;
}

struct ConnectionSums {
  std::uint64_t discarded = 0;
  std::uint64_t refused = 0;
};

ConnectionSums sums_of(const wire::InputStatus& input) {
  ConnectionSums sums;
  for (const wire::ConnectionStatus& each : input.connections) {
    sums.discarded += each.discarded;
    sums.refused += each.refused;
  }
  return sums;
}

std::optional<PortRates> rates_of(const wire::InputStatus& before, const wire::InputStatus& now,
                                  double seconds) {
  if (!before.open || !now.open) return std::nullopt;
  const ConnectionSums were = sums_of(before);
  const ConnectionSums are = sums_of(now);
  const auto taken = per_second(before.open->taken, now.open->taken, seconds);
  const auto lost = per_second(before.open->dropped + before.open->overtaken,
                               now.open->dropped + now.open->overtaken, seconds);
  if (!taken || !lost) return std::nullopt;
  // Those of connections begin again with each connection: then they are left out.
  return PortRates{*taken, *lost + per_second(were.refused, are.refused, seconds).value_or(0),
                   per_second(were.discarded, are.discarded, seconds).value_or(0)};
}

std::optional<SourceRates> rates_of(const wire::SourceStatus& before, const wire::SourceStatus& now,
                                    double seconds) {
  if (!before.open || !now.open) return std::nullopt;
  const auto published = per_second(before.open->published, now.open->published, seconds);
  const auto signals = per_second(before.open->signals, now.open->signals, seconds);
  if (!published || !signals) return std::nullopt;
  return SourceRates{*published, *signals};
}

PortFact fact_of(const wire::InputStatus& input) {
  PortFact fact;
  fact.name = input.name;
  fact.is_open = input.open.has_value();
  fact.component = input.open ? watch::process_text(input.open->component)
                              : (input.away_pid ? "away" : "not open");
  fact.is_arbitrated = input.arbitrated;
  for (const wire::ConnectionStatus& each : input.connections) {
    fact.waiting += each.waiting;
    if (each.waiting != 0) fact.queues.emplace_back(each.source, each.waiting);
    fact.depth = std::max<std::uint64_t>(fact.depth, each.depth.value_or(0));
  }
  if (input.cannot_deliver) {
    fact.useless = input.cannot_deliver->source;
    fact.why_useless = input.cannot_deliver->why;
  }
  return fact;
}

SourceFact fact_of(const wire::SourceStatus& source) {
  SourceFact fact;
  fact.name = source.name;
  fact.is_open = source.open.has_value();
  fact.component = source.open ? watch::process_text(source.open->component)
                               : (source.away_pid ? "away" : "not open");
  fact.host = watch::host_of(source);
  fact.timeout = source.timeout;
  return fact;
}

std::string model_text(const wire::ModelStatus& model) {
  if (model.generation == 0) return "no model";
  std::string text = "model " + std::to_string(model.generation);
  if (model.name && *model.name != "default") text += " \"" + *model.name + '"';
  return text;
}

shm::Nanoseconds first_model_since(const StampedStatus& now) {
  const auto& history = now.status.history;
  if (history.size() != 1 || history.front().how != "start") return 0;
  constexpr shm::Nanoseconds kMillisecond = 1'000'000;
  const shm::Nanoseconds wall =
      std::chrono::duration_cast<std::chrono::nanoseconds>(now.wall.time_since_epoch()).count();
  // The calendar clock may have been set in between, and the document may say anything.
  const shm::Nanoseconds latest = std::max<shm::Nanoseconds>(wall, 0) / kMillisecond;
  const shm::Nanoseconds since =
      std::clamp<shm::Nanoseconds>(history.front().since_ms, 0, latest) * kMillisecond;
  return std::clamp<shm::Nanoseconds>(now.at - std::max<shm::Nanoseconds>(wall - since, 0), 1,
                                      now.at);
}

template <class Fact>
void sort_by_name(std::vector<Fact>& facts) {
  std::sort(facts.begin(), facts.end(),
            [](const Fact& a, const Fact& b) { return a.name < b.name; });
}

}  // namespace

std::ptrdiff_t Census::find_port(const std::string& name) const { return find(ports, name); }
std::ptrdiff_t Census::find_source(const std::string& name) const { return find(sources, name); }

Census census_of(const StampedStatus& now, const StampedStatus* before) {
  Census census;
  census.at = now.at;
  census.asked = now.asked;
  census.instance = now.status.instance;
  census.model = model_text(now.status.model);
  census.first_model_since = first_model_since(now);
  census.strangers = now.status.strangers.size();
  std::map<std::string_view, const wire::InputStatus*> inputs;
  std::map<std::string_view, const wire::SourceStatus*> sources;
  if (before != nullptr) {
    for (const auto& each : before->status.inputs) inputs[each.name] = &each;
    for (const auto& each : before->status.sources) sources[each.name] = &each;
  }
  const double seconds = before == nullptr ? 0 : static_cast<double>(now.at - before->at) / 1e9;
  std::map<std::string, std::vector<std::string>> ports_of;
  for (const wire::InputStatus& each : now.status.inputs) {
    census.ports.push_back(fact_of(each));
    for (const auto& connection : each.connections) {
      ports_of[connection.source].push_back(each.name);
    }
    for (const auto& sensed : each.senses) ports_of[sensed.source].push_back(each.name);
    if (const auto was = inputs.find(each.name); was != inputs.end()) {
      census.ports.back().rates = rates_of(*was->second, each, seconds);
    }
  }
  for (const wire::SourceStatus& each : now.status.sources) {
    census.sources.push_back(fact_of(each));
    census.sources.back().ports = std::move(ports_of[each.name]);
    if (const auto was = sources.find(each.name); was != sources.end()) {
      census.sources.back().rates = rates_of(*was->second, each, seconds);
    }
  }
  sort_by_name(census.ports);
  sort_by_name(census.sources);
  return census;
}

shm::Nanoseconds Frame::last_event(std::size_t source) const {
  return std::max<shm::Nanoseconds>(shm::time_of(words[source], census->sources[source].timeout),
                                    0);
}

}  // namespace arbiter::top
