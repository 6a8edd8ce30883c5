#include "service/status.hpp"

#include <unistd.h>

#include <algorithm>
#include <iterator>
#include <string_view>

#include <nlohmann/json.hpp>

#include "service/model_copy.hpp"
#include "shm/clock.hpp"
#include "shm/decision.hpp"
#include "shm/utf8.hpp"

namespace arbiter::service {
namespace {

using nlohmann::json;

std::uint64_t read(const shm::Atomic<std::uint64_t>& counter) {
  return counter.load(std::memory_order_relaxed);
}

json type_json(const shm::TypeInfo& type) {
  if (!type.is_typed()) return nullptr;
  return {{"name", shm::printable(type.type_name())},
          {"size", type.size},
          {"alignment", type.alignment}};
}

json client_json(const Client& client) {
  return {{"node", client.name}, {"pid", client.pid()}, {"user", client.user()}};
}

json stranger_json(const Stranger& stranger) {
  return {{"node", stranger.node},       {"pid", stranger.process.pid}, {"user", stranger.user},
          {"why", stranger.why},         {"since_ns", stranger.since},  {"seen_ns", stranger.seen},
          {"outputs", stranger.outputs}, {"inputs", stranger.inputs}};
}

// What a full queue had no room for is lost already, though its receiver counts it when it takes.
void count_lost(json& counters) {
  const auto waiting = counters["waiting"].get<std::uint64_t>();
  const auto depth = counters["depth"].get<std::uint64_t>();
  if (depth == 0 || waiting <= depth) return;
  counters["waiting"] = depth;
  counters["overtaken"] = counters["overtaken"].get<std::uint64_t>() + (waiting - depth);
  counters["lost"] = waiting - depth;
}

// What the publisher's and the receiver's segment say of one connection.
json connection_counters(const OutputPort* output, const InputPort* input, const Link* link) {
  json counters{{"accepted", 0}, {"discarded", 0}, {"refused", 0}, {"taken", 0},
                {"dropped", 0},  {"overtaken", 0}, {"waiting", 0}, {"lost", 0}};
  if (link == nullptr || link->number == 0) return counters;
  const shm::OutputSegment segment(output->mapping.data(), output->layout);
  for (std::uint32_t i = 0; i < shm::kMaxDestinations; ++i) {
    const shm::Channel& channel = segment.channel(i);
    if (channel.receiver.load(std::memory_order_relaxed) != link->number) continue;
    const std::uint64_t before = read(channel.first) - 1;
    const std::uint64_t accepted = read(channel.accepted);
    counters["accepted"] = accepted - before;
    counters["discarded"] = read(channel.discarded);
    counters["refused"] = read(channel.refused);
    counters["depth"] = channel.depth.load(std::memory_order_relaxed);
    counters["waiting"] = accepted - before;  // a receiver that has never taken has no lane yet
    for (const shm::Lane& lane : input->shared().lanes) {
      if (lane.publisher.load(std::memory_order_relaxed) != output->instance) continue;
      const std::uint64_t consumed = std::max(read(lane.consumed), before);
      counters["taken"] = read(lane.taken);
      counters["dropped"] = read(lane.dropped);
      counters["overtaken"] = read(lane.overtaken);
      counters["waiting"] = accepted - std::min(consumed, accepted);
    }
    count_lost(counters);
  }
  return counters;
}

// An end that is away has not been closed: its connections go on.
std::string connection_state(const Source& source, const OutputPort* output, const InputName& name,
                             const InputPort* input) {
  const char* const out = output != nullptr ? "" : source.away != 0 ? "away" : "closed";
  const char* const in = input != nullptr ? "" : name.away != 0 ? "away" : "closed";
  if (output != nullptr && input != nullptr) return "connected";
  if (output != nullptr) return std::string("input port ") + in;
  if (input != nullptr) return std::string("output port ") + out;
  if (std::string_view(out) == in) return std::string("both ends ") + out;
  return std::string("output port ") + out + ", input port " + in;
}

class Document {
 public:
  Document(const StatusOf& of, shm::Nanoseconds now)
      : of_(of), snapshot_(of.models.in_force()), now_(now) {}

  json build() {
    json document;
    document["instance"] = of_.instance;
    document["pid"] = getpid();
    document["directory"] = working_directory();  // that relative paths are meant from
    document["model"] = model_json();
    document["models"] = json::array();
    for (const LoadedModel& each : of_.library.models()) {
      document["models"].push_back(loaded_json(*each.model));
    }
    document["history"] = of_.history.json();
    document["clients"] = of_.clients;
    document["strangers"] = json::array();
    for (const Stranger* each : of_.strangers.living()) {
      document["strangers"].push_back(stranger_json(*each));
    }
    document["sources"] = json::array();
    for (const auto& source : of_.directory.sources()) {
      if (is_worth_showing(*source)) document["sources"].push_back(source_json(*source));
    }
    document["inputs"] = json::array();
    for (const auto& input : of_.directory.inputs()) {
      if (input->open != 0 || input->away != 0 || snapshot_.table.knows_port(input->id)) {
        document["inputs"].push_back(input_json(*input));
      }
    }
    return document;
  }

 private:
  static void add_files(const rules::ModelFiles& files, json& result) {
    result["files"] = files.models;
    result["application"] = files.application ? json(*files.application) : json(nullptr);
  }

  [[nodiscard]] json model_json() const {
    const std::string name = of_.models.name();
    json result{{"generation", snapshot_.generation},
                {"name", name.empty() ? json(nullptr) : json(name)},
                {"reloads_refused", of_.reloads_refused}};
    add_files(of_.model == nullptr ? rules::ModelFiles() : of_.model->files, result);
    return result;
  }

  // After a rollback the model in force has the name of one that is loaded, but is not that one.
  [[nodiscard]] json loaded_json(const Model& model) const {
    json result{{"name", model.name},
                {"in_force", model.name == of_.models.name()},
                {"as_loaded", &model == of_.model.get()}};
    add_files(model.files, result);
    return result;
  }

  [[nodiscard]] bool is_worth_showing(const Source& source) const {
    return source.open != 0 || source.away != 0 || snapshot_.table.knows_source(source.id);
  }

  [[nodiscard]] bool is_active(const Source& source) const {
    if (!source.has_page()) return false;
    return shm::is_active(source.activity().word.load(std::memory_order_relaxed), now_);
  }

  // Of one that has not come back no more is known than its process.
  static void add_away(shm::PortInstance away, const RegistryEntry& entry, json& result) {
    result["away"] = away != 0;
    result["away_pid"] = away != 0 ? json(entry.owner().process.pid) : json(nullptr);
  }

  [[nodiscard]] json source_json(const Source& source) const {
    const shm::Nanoseconds timeout = snapshot_.table.timeout(source.id);
    json result{{"name", source.name},
                {"mentioned", snapshot_.table.knows_source(source.id)},
                {"active", is_active(source)},
                {"timeout_ns", timeout == shm::kForever ? json("forever") : json(timeout)}};
    const OutputPort* output = of_.switchboard.output(source.open);
    result["open"] = output != nullptr;
    add_away(source.away, of_.registry.source(source.id), result);
    if (output == nullptr) return result;
    const auto& counters = output->header().counters;
    result["component"] = client_json(*output->client);
    result["type"] = type_json(output->type);
    result["published"] = read(counters.published);
    result["signals"] = read(counters.signals);
    result["delivered"] = read(counters.delivered);
    result["discarded"] = read(counters.discarded);
    result["refused"] = read(counters.refused);
    result["blind"] = read(counters.blind);
    result["unsettled"] = read(counters.unsettled);
    result["no_slot"] = read(counters.no_slot);
    return result;
  }

  json input_json(const InputName& name) {
    const InputPort* input = of_.switchboard.input(name.open);
    const Command command = command_at(name.id, input);
    const shm::SourceId winner = command.commander;
    const bool arbitrated = snapshot_.table.is_arbitrated(name.id);
    json result{
        {"name", name.name},
        {"mentioned", snapshot_.table.knows_port(name.id)},
        {"arbitrated", arbitrated},
        {"in_order", is_decided_in_order(name.id)},
        {"idle", winner == shm::kNone},
        {"winner", arbitrated && winner != shm::kNone ? json(of_.directory.sources()[winner]->name)
                                                      : json(nullptr)},
        {"cannot_deliver", nullptr},
        {"connections", json::array()},
        {"senses", json::array()}};
    if (command.selected != shm::kNone && winner == shm::kNone) {
      result["cannot_deliver"] = {{"source", of_.directory.sources()[command.selected]->name},
                                  {"why", command.why}};
    }
    result["open"] = input != nullptr;
    add_away(name.away, of_.registry.input(name.id), result);
    if (input != nullptr) add_open(*input, result);
    add_connections(name, input, winner, result);
    return result;
  }

  static void add_open(const InputPort& input, json& result) {
    const shm::InputHeader& header = input.shared().header;
    result["component"] = client_json(*input.client);
    result["type"] = type_json(input.type);
    result["depth"] = header.depth;
    result["keep"] = header.keep != 0;
    result["when_full"] = header.refuse_new != 0 ? "refuse_new" : "drop_oldest";
    result["taken"] = read(header.counters.taken);
    result["dropped"] = read(header.counters.dropped);
    result["overtaken"] = read(header.counters.overtaken);
    result["blind"] = read(header.counters.blind);
    result["unsettled"] = read(header.counters.unsettled);
    result["misbehaved"] = read(header.counters.misbehaved);
    result["idles"] = read(header.counters.idles);
  }

  void add_connections(const InputName& name, const InputPort* input, shm::SourceId winner,
                       json& result) {
    std::set<shm::SourceId> connected;
    std::uint64_t lost = 0;  // and not counted by the receiver yet
    const auto range = snapshot_.table.connections_to(name.id);
    for (auto index = range.first; index != range.first + range.count; ++index) {
      const shm::SourceId id = snapshot_.table.rule(index).source;
      const auto* source =
          id < of_.directory.sources().size() ? of_.directory.sources()[id].get() : nullptr;
      if (source == nullptr) continue;
      connected.insert(id);
      const OutputPort* output = of_.switchboard.output(source->open);
      const Link* link = link_between(output, input);
      json connection = connection_counters(output, input, link);
      lost += connection["lost"].get<std::uint64_t>();
      connection.erase("lost");
      connection["source"] = source->name;
      connection["active"] = is_active(*source);
      connection["winner"] = id == winner && snapshot_.table.is_arbitrated(name.id);
      connection["state"] = connection_state(*source, output, name, input);
      connection["mismatch"] = nullptr;
      if (link != nullptr && !link->mismatch.empty()) {
        connection["state"] = "mismatch";
        connection["mismatch"] = link->mismatch;
      }
      result["connections"].push_back(std::move(connection));
    }
    if (input != nullptr) result["overtaken"] = result["overtaken"].get<std::uint64_t>() + lost;
    const auto senses = snapshot_.table.sources_read(name.id);
    for (shm::Word i = 0; i < senses.count; ++i) {
      if (connected.count(senses[i]) != 0 || senses[i] >= of_.directory.sources().size()) continue;
      const Source& source = *of_.directory.sources()[senses[i]];
      result["senses"].push_back({{"source", source.name}, {"active", is_active(source)}});
    }
  }

  [[nodiscard]] const Link* link_between(const OutputPort* output, const InputPort* input) const {
    if (output == nullptr || input == nullptr) return nullptr;
    const auto found = of_.switchboard.links().find({output->instance, input->instance});
    return found == of_.switchboard.links().end() ? nullptr : &found->second;
  }

  [[nodiscard]] bool is_decided_in_order(shm::PortId port) const {
    const auto range = snapshot_.table.connections_to(port);
    for (auto index = range.first; index != range.first + range.count; ++index) {
      if (snapshot_.table.rule(index).kind == shm::table::kInOrder) return true;
    }
    return false;
  }

  // As InputCore::who_commands().
  struct Command {
    shm::SourceId selected = shm::kNone;
    shm::SourceId commander = shm::kNone;  // else the port is idle
    std::string why;                       // the one that is selected cannot deliver
  };
  [[nodiscard]] Command command_at(shm::PortId port, const InputPort* input) const {
    shm::DecisionClock clock(now_, true);
    shm::Decider decider(snapshot_.table, of_.directory.pages(), clock);
    Command command;
    const auto range = snapshot_.table.connections_to(port);
    for (auto index = range.first; index != range.first + range.count; ++index) {
      const shm::Rule rule = snapshot_.table.rule(index);
      if (decider.decide_with_own(rule) != shm::Verdict::kWins) continue;
      const std::string why = why_nothing_can_come(rule.source, input);
      if (why.empty()) command.commander = rule.source;
      if (command.selected == shm::kNone) {
        command.selected = rule.source;
        command.why = why;
      }
      if (why.empty() || snapshot_.table.is_arbitrated(port)) break;
    }
    return command;
  }

  // Of an active source. Empty: something can.
  [[nodiscard]] std::string why_nothing_can_come(shm::SourceId id, const InputPort* input) const {
    const Source& source = *of_.directory.sources()[id];
    const Link* link = link_between(of_.switchboard.output(source.open), input);
    if (link != nullptr && link->is_refused()) return link->mismatch;
    if (source.open != 0 || source.away != 0) return {};
    const shm::ActivityWord word = source.activity().word.load(std::memory_order_relaxed);
    const shm::Nanoseconds timeout = snapshot_.table.timeout(id);
    if (shm::ends_within(word, timeout, shm::monotonic_now()) || waits(id, input)) return {};
    return "no component has " + source.name + " open, and its activity lasts " +
           (shm::is_finite(word) ? "for longer than its T" : "for ever") +
           " (`arbiter deactivate " + source.name + "` ends it)";
  }

  // Whether a receiver still has a queue of a publisher that has gone: once it has found it empty,
  // it says that it is nobody's.
  [[nodiscard]] static bool waits(shm::SourceId source, const InputPort* input) {
    if (input == nullptr) return false;
    return std::any_of(std::begin(input->shared().lanes), std::end(input->shared().lanes),
                       [&](const shm::Lane& lane) {
                         return lane.publisher.load(std::memory_order_relaxed) != 0 &&
                                lane.source.load(std::memory_order_relaxed) == source;
                       });
  }

  const StatusOf& of_;
  const shm::TableSnapshot snapshot_;
  const shm::Nanoseconds now_;
};

}  // namespace

std::string status_document(const StatusOf& of, shm::Nanoseconds now) {
  // Names may be any bytes; JSON may not.
  return Document(of, now).build().dump(2, ' ', false, json::error_handler_t::replace) + "\n";
}

}  // namespace arbiter::service
