#include "wire/status.hpp"

#include <algorithm>
#include <array>

#include <nlohmann/json.hpp>

#include "wire/document.hpp"
#include "wire/fields.hpp"
#include "wire/past_model_fields.hpp"

namespace arbiter::wire {
namespace {

// All that the ends of a connection can be, and how the document says it.
struct State {
  const char* text;
  End output;
  End input;
};
constexpr const char* kMismatch = "mismatch";
constexpr std::array<State, 9> kStates{
    {{"connected", End::kOpen, End::kOpen},
     {"input port away", End::kOpen, End::kAway},
     {"input port not open", End::kOpen, End::kClosed},
     {"output port away", End::kAway, End::kOpen},
     {"output port not open", End::kClosed, End::kOpen},
     {"both ends away", End::kAway, End::kAway},
     {"neither end open", End::kClosed, End::kClosed},
     {"output port not open, input port away", End::kClosed, End::kAway},
     {"output port away, input port not open", End::kAway, End::kClosed}}};

constexpr std::array<const char*, 2> kWhenFull{"drop_oldest", "refuse_new"};

template <class Named>
const Named* find_named(const std::vector<Named>& list, std::string_view name) {
  const auto found =
      std::find_if(list.begin(), list.end(), [&](const Named& each) { return each.name == name; });
  return found == list.end() ? nullptr : &*found;
}

// The ends stand in one field.
void describe_state(FieldWriter& field, const ConnectionStatus& of) { field("state", of.state()); }

void describe_state(FieldReader& field, ConnectionStatus& of) {
  static const auto names = [] {
    std::array<const char*, kStates.size() + 1> all{};
    for (std::size_t i = 0; i < kStates.size(); ++i) all[i] = kStates[i].text;
    all.back() = kMismatch;
    return all;
  }();
  std::size_t index = 0;
  field.choice("state", index, names);
  if ((index == kStates.size()) != of.mismatch.has_value()) {
    field.refuse("state", "does not agree with mismatch");
  }
  of.output = index == kStates.size() ? End::kOpen : kStates[index].output;
  of.input = index == kStates.size() ? End::kOpen : kStates[index].input;
}

}  // namespace

void describe(auto& field, Is<Component> auto& of) {
  field("node", of.node);
  field("pid", of.pid);
  field("user", of.user);
}

void describe(auto& field, Is<SampleType> auto& of) {
  field("name", of.name);
  field("size", of.size);
  field("alignment", of.alignment);
}

void describe(auto& field, Is<RefusedFilesStatus> auto& of) {
  field("files", of.files);
  field("why", of.why);
}

void describe(auto& field, Is<ModelStatus> auto& of) {
  field("generation", of.generation);
  field("name", of.name);
  field.counter("reloads_refused", of.reloads_refused);
  field("files", of.files);
  field("application", of.application);
  field.maybe("refused", of.refused);
}

void describe(auto& field, Is<LoadedModelStatus> auto& of) {
  field("name", of.name);
  field("in_force", of.in_force);
  field("as_loaded", of.as_loaded);
  field("files", of.files);
  field("application", of.application);
}

void describe(auto& field, Is<StrangerStatus> auto& of) {
  field("node", of.node);
  field("pid", of.pid);
  field("user", of.user);
  field("why", of.why);
  field("since_ns", of.since);
  field("seen_ns", of.seen);
  field("outputs", of.outputs);
  field("inputs", of.inputs);
}

void describe(auto& field, Is<DeathStatus> auto& of) {
  field("node", of.node);
  field("pid", of.pid);
  field("user", of.user);
  field("at_ns", of.at);
  field("outputs", of.outputs);
  field("inputs", of.inputs);
  field("opened_since", of.opened_since);
}

void describe(auto& field, Is<RefusalStatus> auto& of) {
  field("node", of.node);
  field("pid", of.pid);
  field("user", of.user);
  field("at_ns", of.at);
  field("why", of.why);
  field.maybe("output", of.output);
  field.maybe("input", of.input);
}

void describe(auto& field, Is<OpenOutput> auto& of) {
  field("component", of.component);
  field("taps", of.taps);
  field("type", of.type);
  field("max_size", of.max_size);
  field.counter("published", of.published);
  field.counter("signals", of.signals);
  field.counter("delivered", of.delivered);
  field.counter("discarded", of.discarded);
  field.counter("refused", of.refused);
  field.counter("blind", of.blind);
  field.counter("unsettled", of.unsettled);
  field.counter("no_slot", of.no_slot);
  field.counter("late", of.late);
  field.maybe("described", of.described);
  field.maybe("trouble", of.trouble);
}

void describe(auto& field, Is<SourceStatus> auto& of) {
  field("name", of.name);
  field("mentioned", of.mentioned);
  field("active", of.active);
  field.span("timeout_ns", of.timeout);
  field.has("away", of.away_pid);
  field("away_pid", of.away_pid);
  field.beside("open", of.open);
}

void describe(auto& field, Is<ConnectionStatus> auto& of) {
  field("source", of.source);
  field("active", of.active);
  field("winner", of.winner);
  field("mismatch", of.mismatch);
  describe_state(field, of);
  field.maybe("depth", of.depth);
  field.counter("accepted", of.accepted);
  field.counter("discarded", of.discarded);
  field.counter("refused", of.refused);
  field.counter("taken", of.taken);
  field.counter("dropped", of.dropped);
  field.counter("overtaken", of.overtaken);
  field.counter("waiting", of.waiting);
}

void describe(auto& field, Is<SensedStatus> auto& of) {
  field("source", of.source);
  field("active", of.active);
}

void describe(auto& field, Is<OpenInput> auto& of) {
  field("component", of.component);
  field("type", of.type);
  field("depth", of.depth);
  field("keep", of.keep);
  field.choice("when_full", of.when_full, kWhenFull);
  field.counter("taken", of.taken);
  field.counter("dropped", of.dropped);
  field.counter("overtaken", of.overtaken);
  field.counter("blind", of.blind);
  field.counter("unsettled", of.unsettled);
  field.counter("misbehaved", of.misbehaved);
  field.counter("idles", of.idles);
  field.maybe("described", of.described);
  field.maybe("trouble", of.trouble);
}

void describe(auto& field, Is<UselessWinner> auto& of) {
  field("source", of.source);
  field("why", of.why);
}

void describe(auto& field, Is<InputStatus> auto& of) {
  field("name", of.name);
  field("mentioned", of.mentioned);
  field("arbitrated", of.arbitrated);
  field("in_order", of.in_order);
  field("idle", of.idle);
  field("winner", of.winner);
  field("cannot_deliver", of.cannot_deliver);
  field("connections", of.connections);
  field("senses", of.senses);
  field.has("away", of.away_pid);
  field("away_pid", of.away_pid);
  field.beside("open", of.open);
}

void describe(auto& field, Is<Status> auto& of) {
  field("instance", of.instance);
  field("pid", of.pid);
  field("directory", of.directory);
  field.maybe("at_ns", of.now);
  field("model", of.model);
  field("models", of.models);
  field("history", of.history);
  field("clients", of.clients);
  field("strangers", of.strangers);
  field("deaths", of.deaths);
  field.list("refusals", of.refusals);
  field("sources", of.sources);
  field("inputs", of.inputs);
}

std::string ConnectionStatus::state() const {
  if (mismatch) return kMismatch;
  const auto found = std::find_if(kStates.begin(), kStates.end(), [this](const State& each) {
    return each.output == output && each.input == input;
  });
  return found->text;  // each pair of ends is there
}

const SourceStatus* Status::find_source(std::string_view name) const {
  return find_named(sources, name);
}

const InputStatus* Status::find_input(std::string_view name) const {
  return find_named(inputs, name);
}

nlohmann::json to_json(const Status& status) { return FieldWriter::json_of(status); }

nlohmann::json to_json(const PastModelStatus& model) { return FieldWriter::json_of(model); }

nlohmann::json to_json(const std::vector<LoadedModelStatus>& models) {
  return FieldWriter::json_of(models);
}

nlohmann::json to_json(const std::vector<PastModelStatus>& history) {
  return FieldWriter::json_of(history);
}

Status read_status(std::string_view text) { return FieldReader::read_whole<Status>(text); }

}  // namespace arbiter::wire
