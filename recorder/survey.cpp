#include "recorder/survey.hpp"

#include <algorithm>
#include <optional>
#include <utility>

#include "evidence/models.hpp"
#include "evidence/record_reader.hpp"
#include "rules/model/load.hpp"
#include "rules/prove/compile.hpp"
#include "shm/port_picture.hpp"

namespace arbiter::recorder {
namespace {

using evidence::Arrival;
using evidence::Nanoseconds;
using evidence::Record;

std::optional<rules::CompiledModel> compiled(const evidence::ModelChange& model) {
  if (!model.has_texts) return std::nullopt;
  rules::Diagnostics diagnostics;
  auto result = rules::compile(rules::load(evidence::texts_of(model), diagnostics), diagnostics);
  if (diagnostics.has_errors()) return std::nullopt;
  return result;
}

class Surveyor {
 public:
  explicit Surveyor(const evidence::TimeSpan& part) : part_(part) { found_.first = part.from; }

  void take(const Record& record) {
    ++read_;
    if (const auto* start = std::get_if<evidence::Start>(&record)) {
      if (found_.first == 0) found_.first = start->time;
      if (start->time <= part_.from) forget_who_was_active();
    } else if (const auto* model = std::get_if<evidence::ModelChange>(&record)) {
      if (!model_ || model->time <= part_.from) model_ = *model;
    }
    const auto* context = evidence::context_of(record);
    if (context == nullptr) return;
    SurveyedSource& source = found_.sources[context->source];
    const auto* arrival = std::get_if<Arrival>(&record);
    const bool has_payload = arrival != nullptr && arrival->has_payload;
    // That of its last payload; if it has none, the last that was told.
    const bool tells_type = context->size != 0 && (has_payload || source.payloads == 0);
    if (tells_type && !have_one_type(source.type, *context)) {
      source.type = *context;
    } else if (tells_type) {
      source.type.size = std::max(source.type.size, context->size);
    }
    for (const std::string& port : context->destinations) {
      found_.sources_of_ports[port].insert(context->source);
    }
    if (arrival != nullptr) {
      note_event(source, arrival->time, arrival->word);
      if (!part_.has(arrival->time)) return;
      source.samples += arrival->is_sample ? 1 : 0;
      source.payloads += has_payload ? 1 : 0;
      source.largest = std::max(source.largest, arrival->size);
    } else if (const auto* over = std::get_if<evidence::Deactivation>(&record)) {
      note_event(source, over->time, shm::deactivated(source.word, over->time));
    } else if (const auto* state = std::get_if<evidence::SourceState>(&record)) {
      take_state(*state, source);
    }
  }

  Survey finish() {
    std::stable_sort(found_.untold.begin(), found_.untold.end(),
                     [](const auto& one, const auto& other) { return one.time < other.time; });
    const auto model = model_ ? compiled(*model_) : std::nullopt;
    if (model) apply(rules::Simulation(*model));
    return std::move(found_);
  }

 private:
  // Another daemon, with memory of its own, does not know it.
  void forget_who_was_active() {
    for (auto& [name, source] : found_.sources) source.word = source.at_start = shm::kNeverActive;
  }

  // What was before the part is how it is as that begins.
  void note_event(SurveyedSource& source, Nanoseconds time, evidence::ActivityWord word) {
    source.word = word;
    if (time < part_.from) {
      source.at_start = word;
    } else if (part_.has(time)) {
      source.has_events = true;
      found_.latest = std::max(found_.latest, time);
      found_.last_event = read_;
    }
  }

  void take_state(const evidence::SourceState& state, SurveyedSource& source) {
    const auto before = std::exchange(source.word, state.word);
    if (!source.has_events && state.seen <= found_.first) source.at_start = state.word;
    if (before == state.word || !shm::is_deactivation(state.word)) return;
    const Nanoseconds time = shm::time_of(state.word, shm::kForever);
    if (time <= found_.first || time > state.seen || !part_.has(time)) return;
    source.has_events = true;
    found_.latest = std::max(found_.latest, time);
    found_.untold.push_back({state.context, time, state.seen, state.sequence, state.generation});
  }

  void apply(const rules::Simulation& simulation) {
    for (auto& [name, source] : found_.sources) {
      // One that the model does not name has the model's.
      const shm::SourceId id = simulation.knows(name) ? simulation.source_id(name) : shm::kNone;
      source.timeout = simulation.table().timeout(id);
    }
    for (shm::PortId port = 0; port < simulation.port_names().size(); ++port) {
      shm::for_each_heeded(simulation.table(), port, [&](shm::SourceId id) {
        found_.sources_of_ports[simulation.port_name(port)].insert(simulation.source_name(id));
      });
    }
  }

  const evidence::TimeSpan part_;
  Survey found_;
  std::optional<evidence::ModelChange> model_;  // in force at first
  std::uint64_t read_ = 0;                      // records
};

}  // namespace

bool have_one_type(const evidence::SourceContext& one, const evidence::SourceContext& other) {
  if (one.type != other.type) return false;
  const bool is_variable = one.alignment == 0;
  return one.type.empty() ||
         (one.alignment == other.alignment && (is_variable || one.size == other.size));
}

Survey survey(const std::string& file, const evidence::TimeSpan& part,
              const std::function<void(const std::string&)>& say, const recording::Watch& watch) {
  Surveyor surveyor(part);
  const auto about = evidence::read_recording(
      file, evidence::Payloads::pass_over, [&](Record&& record) { surveyor.take(record); }, watch,
      part);
  if (!about.end.is_whole)
    say(file + ": " + about.end.problem + "; what comes before is published");
  return surveyor.finish();
}

}  // namespace arbiter::recorder
