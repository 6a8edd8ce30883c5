#include "tests/link/failures/evidence_of_host.hpp"

#include <algorithm>
#include <cstring>
#include <iterator>
#include <stdexcept>
#include <variant>

#include "evidence/record_reader.hpp"
#include "evidence/verification.hpp"
#include "rules/model/load.hpp"
#include "rules/prove/compile.hpp"
#include "tests/link/failures/plan.hpp"

namespace arbiter::failures {
namespace {

// No sample arrives that is older.
constexpr Nanoseconds kOfAnotherLife = 2 * kSecond;

bool won_at(const evidence::Arrival& arrival, const std::string& motor) {
  const auto& ports = arrival.context->destinations;
  const auto found = std::find(ports.begin(), ports.end(), motor);
  if (found == ports.end()) return false;
  const auto bit = std::uint64_t{1} << (found - ports.begin());
  return (arrival.masks.accepted & bit) != 0;
}

Happened happened(const evidence::Arrival& arrival, const std::string& motor) {
  Happened result;
  result.kind = arrival.is_sample ? Happened::Kind::sample : Happened::Kind::signal;
  result.time = arrival.time;
  result.seen = arrival.seen;
  result.won = won_at(arrival, motor);
  result.exporter = arrival.origin.publisher;
  result.sequence = arrival.origin.publisher != 0 ? arrival.origin.sequence : arrival.sequence;
  if (arrival.payload && arrival.payload->size() >= sizeof(Command)) {
    result.command.emplace();
    std::memcpy(&*result.command, arrival.payload->data(), sizeof(Command));
  }
  return result;
}

// Where a recorder begins again, its old taps and its new ones tell the same for a moment. Nothing
// is published twice at one time.
bool is_told(const std::vector<Happened>& events, const Happened& event) {
  constexpr std::ptrdiff_t kLast = 200;
  const auto from = events.end() - std::min<std::ptrdiff_t>(kLast, std::ssize(events));
  return std::any_of(from, events.end(), [&](const Happened& each) {
    return each.time == event.time && each.kind == event.kind && each.sequence == event.sequence &&
           each.exporter == event.exporter;
  });
}

rules::CompiledModel compile_texts(const rules::ModelTexts& texts) {
  rules::Diagnostics diagnostics;
  auto compiled = rules::compile(rules::load(texts, diagnostics), diagnostics);
  if (diagnostics.has_errors()) throw std::runtime_error("a recorded model has errors");
  return compiled;
}

}  // namespace

void add(HostEvidence& evidence, const std::string& motor, const evidence::Record& record) {
  if (const auto* arrival = std::get_if<evidence::Arrival>(&record)) {
    std::vector<Happened>& events = evidence.sources[arrival->context->source];
    const Happened event = happened(*arrival, motor);
    if (evidence.beginnings.size() < 2 || !is_told(events, event)) events.push_back(event);
  } else if (const auto* end = std::get_if<evidence::Deactivation>(&record)) {
    Happened result;
    result.kind = Happened::Kind::deactivation;
    result.time = end->time;
    result.seen = end->seen;
    evidence.sources[end->context->source].push_back(result);
  } else if (std::holds_alternative<evidence::Start>(record)) {
    evidence.beginnings.push_back(0);
  } else if (const auto* port = std::get_if<evidence::PortChange>(&record)) {
    using What = evidence::PortChange::What;
    const bool is_gone = port->what == What::closed || port->what == What::died;
    if (!port->is_input && is_gone) evidence.closures[port->port].push_back(port->seen);
  } else if (const auto* model = std::get_if<evidence::ModelChange>(&record)) {
    // The first one, which nobody has switched to, is said without its name.
    evidence.models.push_back({model->time, model->generation,
                               model->name.empty() ? kModels[0] : model->name, model->how});
    if (evidence.beginnings.back() != 0) return;
    evidence.beginnings.back() = model->time;
    // The recorder notices the new daemon a little later than it has come; until then its old taps
    // tell what its new ones tell as well.
    for (auto& [source, events] : evidence.sources) {
      std::erase_if(events, [&](const Happened& event) { return event.time >= model->time; });
    }
  } else if (const auto* missed = std::get_if<evidence::Missed>(&record)) {
    std::vector<Happened>& events = evidence.sources[missed->source];
    Happened result;
    result.kind = Happened::Kind::gap;
    result.time = missed->from;  // 0: the recorder does not know
    if (result.time == 0 && !events.empty()) result.time = events.back().time;
    result.seen = missed->to;
    result.events = missed->events + missed->samples;
    events.push_back(result);
  } else if (const auto* state = std::get_if<evidence::SourceState>(&record)) {
    using Why = evidence::SourceState::Why;
    const bool is_end = state->why == Why::joined && shm::is_deactivation(state->word);
    if (state->why != Why::gap && !is_end) return;
    Happened result;
    if (is_end) {  // by a port that was deactivated before the recorder joined it
      result.kind = Happened::Kind::deactivation;
      result.is_state = true;
      result.time = state->time;
      result.seen = state->seen;
      evidence.sources[state->context->source].push_back(result);
      return;
    }
    result.kind = Happened::Kind::gap;
    result.time = state->time;
    result.seen = state->seen;
    result.events = std::max<std::uint64_t>(state->lost, 1);
    evidence.sources[state->context->source].push_back(result);
  }
}

bool had_model(const HostEvidence& evidence, const std::string& name, Nanoseconds from,
               Nanoseconds to) {
  const auto after = std::find_if(evidence.models.begin(), evidence.models.end(),
                                  [&](const ModelInForce& each) { return each.time > from; });
  if (after == evidence.models.begin()) return false;
  const ModelInForce& before = *std::prev(after);
  if (before.name != name) return false;
  if (after == evidence.models.end()) return true;
  // A model that was in force for a few milliseconds may not be in the recording.
  return after->time > to && after->generation <= before.generation + 1;
}

HostEvidence said_by(const HostEvidence& evidence, const std::string& source, unsigned host) {
  HostEvidence result;
  result.name = evidence.name;
  const auto found = evidence.sources.find(source);
  if (found == evidence.sources.end()) return result;
  for (const Happened& event : found->second) {
    if (event.command && event.command->host == host) result.sources[source].push_back(event);
  }
  return result;
}

bool began_between(const HostEvidence& host, Nanoseconds earlier, Nanoseconds later) {
  return std::any_of(host.lives.begin(), host.lives.end(),
                     [&](Nanoseconds life) { return earlier < life && life <= later; });
}

void name_own(HostEvidence& evidence, const std::string& source, unsigned host) {
  const std::vector<Nanoseconds>& lives = evidence.lives;
  for (Happened& event : evidence.sources[source]) {
    if (event.kind != Happened::Kind::sample || event.command || event.exporter != 0) continue;
    const auto begun = std::upper_bound(lives.begin(), lives.end(), event.time) - lives.begin();
    event.command = Command{host, static_cast<std::uint32_t>(begun), event.sequence, event.time};
  }
}

void name_imported(HostEvidence& evidence, const HostEvidence& exporter,
                   const std::string& source) {
  const auto its = exporter.sources.find(source);
  if (its == exporter.sources.end()) return;
  std::map<std::uint64_t, std::vector<Command>> published;  // by number, by time
  for (const Happened& event : its->second) {
    if (event.command && event.exporter == 0) {
      published[event.sequence].push_back(*event.command);
    }
  }
  for (Happened& event : evidence.sources[source]) {
    if (event.command || event.exporter == 0) continue;
    const std::vector<Command>& all = published[event.sequence];
    const auto after = std::upper_bound(
        all.begin(), all.end(), event.time,
        [](Nanoseconds time, const Command& command) { return time < command.made; });
    if (after == all.begin()) continue;
    const auto last = std::prev(after);
    const bool may_be_other =
        (last != all.begin() && std::prev(last)->made > event.time - kOfAnotherLife) ||
        began_between(exporter, last->made, event.time);
    if (!may_be_other) event.command = *last;
  }
}

HostEvidence read_evidence(const std::string& name, const std::string& motor,
                           const std::string& path) {
  HostEvidence result;
  result.name = name;
  evidence::read_recording(path, evidence::Payloads::read,
                           [&](evidence::Record&& record) { add(result, motor, record); });
  const evidence::Recorded recorded = evidence::load_recording(path);
  evidence::Models models(compile_texts);
  const evidence::Verification verified = evidence::verify(recorded, models);
  result.decisions = verified.all();
  result.uncertain = verified.all() - verified.equal;
  if (verified.different != 0) {
    result.wrong.push_back(std::to_string(verified.different) +
                           " decisions that its model does not permit, the first: " +
                           (verified.first ? verified.first->text : "unknown"));
  }
  return result;
}

}  // namespace arbiter::failures
