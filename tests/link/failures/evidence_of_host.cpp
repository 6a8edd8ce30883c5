#include "tests/link/failures/evidence_of_host.hpp"

#include <algorithm>
#include <cstring>
#include <stdexcept>
#include <variant>

#include "evidence/record_reader.hpp"
#include "evidence/verification.hpp"
#include "rules/model/load.hpp"
#include "rules/prove/compile.hpp"

namespace arbiter::failures {
namespace {

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

rules::CompiledModel compile_texts(const rules::ModelTexts& texts) {
  rules::Diagnostics diagnostics;
  auto compiled = rules::compile(rules::load(texts, diagnostics), diagnostics);
  if (diagnostics.has_errors()) throw std::runtime_error("a recorded model has errors");
  return compiled;
}

}  // namespace

void add(HostEvidence& evidence, const std::string& motor, const evidence::Record& record) {
  if (const auto* arrival = std::get_if<evidence::Arrival>(&record)) {
    evidence.sources[arrival->context->source].push_back(happened(*arrival, motor));
  } else if (const auto* end = std::get_if<evidence::Deactivation>(&record)) {
    Happened result;
    result.kind = Happened::Kind::deactivation;
    result.time = end->time;
    result.seen = end->seen;
    evidence.sources[end->context->source].push_back(result);
  } else if (std::holds_alternative<evidence::Start>(record)) {
    evidence.beginnings.push_back(0);
  } else if (const auto* model = std::get_if<evidence::ModelChange>(&record)) {
    if (evidence.beginnings.back() != 0) return;
    evidence.beginnings.back() = model->time;
    // The recorder notices the new daemon a little later than it has come; until then its old taps
    // tell what its new ones tell as well.
    for (auto& [source, events] : evidence.sources) {
      std::erase_if(events, [&](const Happened& event) { return event.time >= model->time; });
    }
  } else if (const auto* missed = std::get_if<evidence::Missed>(&record)) {
    Happened result;
    result.kind = Happened::Kind::gap;
    result.time = missed->from;
    result.seen = missed->to;
    result.events = missed->events + missed->samples;
    evidence.sources[missed->source].push_back(result);
  } else if (const auto* state = std::get_if<evidence::SourceState>(&record)) {
    if (state->why != evidence::SourceState::Why::gap) return;
    Happened result;
    result.kind = Happened::Kind::gap;
    result.time = state->time;
    result.seen = state->seen;
    result.events = std::max<std::uint64_t>(state->lost, 1);
    evidence.sources[state->context->source].push_back(result);
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
