#include "service/status.hpp"

#include <unistd.h>

#include <algorithm>
#include <iterator>
#include <optional>
#include <set>
#include <utility>

#include <nlohmann/json.hpp>

#include "service/models/document.hpp"
#include "shm/clock.hpp"
#include "shm/port_picture.hpp"
#include "shm/utf8.hpp"
#include "wire/document.hpp"
#include "wire/status.hpp"

namespace arbiter::service {
namespace {

std::uint64_t read(const shm::Atomic<std::uint64_t>& counter) {
  return counter.load(std::memory_order_relaxed);
}

std::optional<wire::SampleType> type_of(const shm::TypeInfo& type) {
  if (!type.is_typed()) return std::nullopt;
  return wire::SampleType{shm::printable(type.type_name()), type.size, type.alignment};
}

std::optional<std::string> text_of(const std::string& text) {
  return text.empty() ? std::nullopt : std::optional(text);
}

std::optional<bool> trouble_of(const Description& described) {
  return described.is_trouble ? std::optional(true) : std::nullopt;
}

wire::Component component_of(const Client& client) {
  return {client.name, client.pid(), client.user()};
}

wire::StrangerStatus status_of(const Stranger& of) {
  return {of.node,
          of.process.pid,
          of.user,
          of.why,
          of.since,
          of.seen,
          {of.outputs.begin(), of.outputs.end()},
          {of.inputs.begin(), of.inputs.end()}};
}

// What a full queue had no room for is lost already, though its receiver counts it when it takes.
// Returns how much that is.
std::uint64_t count_lost(wire::ConnectionStatus& connection) {
  const std::uint64_t depth = connection.depth.value_or(0);
  if (depth == 0 || connection.waiting <= depth) return 0;
  const std::uint64_t lost = connection.waiting - depth;
  connection.waiting = depth;
  connection.overtaken += lost;
  return lost;
}

// What the publisher's and the receiver's segment say of one connection. Returns what was lost and
// is not counted by the receiver yet.
std::uint64_t add_counters(const OutputPort* output, const InputPort* input, const Link* link,
                           wire::ConnectionStatus& connection) {
  if (link == nullptr || link->number == 0) return 0;
  std::uint64_t lost = 0;
  const shm::OutputSegment segment(output->mapping.data(), output->layout);
  for (std::uint32_t i = 0; i < shm::kMaxDestinations; ++i) {
    const shm::Channel& channel = segment.channel(i);
    if (channel.receiver.load(std::memory_order_relaxed) != link->number) continue;
    const std::uint64_t before = read(channel.first) - 1;
    const std::uint64_t accepted = read(channel.accepted);
    connection.accepted = accepted - before;
    connection.discarded = read(channel.discarded);
    connection.refused = read(channel.refused);
    connection.depth = channel.depth.load(std::memory_order_relaxed);
    connection.waiting = accepted - before;  // a receiver that has never taken has no lane yet
    for (const shm::Lane& lane : input->shared().lanes) {
      if (lane.publisher.load(std::memory_order_relaxed) != output->instance) continue;
      const std::uint64_t consumed = std::max(read(lane.consumed), before);
      connection.taken = read(lane.taken);
      connection.dropped = read(lane.dropped);
      connection.overtaken = read(lane.overtaken);
      connection.waiting = accepted - std::min(consumed, accepted);
    }
    lost = count_lost(connection);
  }
  return lost;
}

// An end that is away has not been closed: its connections go on.
wire::End end_of(const void* port, shm::PortInstance away) {
  return port != nullptr ? wire::End::kOpen : away != 0 ? wire::End::kAway : wire::End::kClosed;
}

class Document {
 public:
  Document(const StatusOf& of, shm::Nanoseconds now)
      : of_(of), snapshot_(of.models.in_force()), now_(now) {}

  wire::Status build() {
    wire::Status status;
    status.instance = of_.instance;
    status.pid = getpid();
    status.directory = working_directory();  // that relative paths are meant from
    status.now = now_;
    status.model = model();
    for (const LoadedModel& each : of_.library.models()) {
      status.models.push_back(loaded(*each.model));
    }
    status.history = of_.history.status();
    status.clients = of_.clients;
    for (const Stranger* each : of_.strangers.living()) {
      status.strangers.push_back(status_of(*each));
    }
    status.deaths.assign(of_.deaths.all().begin(), of_.deaths.all().end());
    status.refusals.assign(of_.refusals.all().begin(), of_.refusals.all().end());
    for (const auto& each : of_.names.sources()) {
      if (is_worth_showing(*each)) status.sources.push_back(source(*each));
    }
    for (const auto& each : of_.names.inputs()) {
      if (each->open != 0 || each->away != 0 || snapshot_.table.knows_port(each->id)) {
        status.inputs.push_back(input(*each));
      }
    }
    return status;
  }

 private:
  [[nodiscard]] wire::ModelStatus model() const {
    const std::string name = of_.models.name();
    const auto files = of_.model == nullptr ? rules::ModelFiles() : of_.model->files;
    return {snapshot_.generation, name.empty() ? std::nullopt : std::optional(name),
            of_.reloads_refused,  files.models,
            files.application,    of_.refused};
  }

  // After a rollback the model in force has the name of one that is loaded, but is not that one.
  [[nodiscard]] wire::LoadedModelStatus loaded(const Model& model) const {
    return {model.name, model.name == of_.models.name(), &model == of_.model.get(),
            model.files.models, model.files.application};
  }

  [[nodiscard]] bool is_worth_showing(const Source& source) const {
    return source.open != 0 || source.away != 0 || snapshot_.table.knows_source(source.id);
  }

  [[nodiscard]] bool is_active(const Source& source) const {
    if (!source.has_page()) return false;
    return shm::is_active(source.activity().word.load(std::memory_order_relaxed), now_);
  }

  // Of one that has not come back no more is known than its process.
  static std::optional<std::int32_t> away_pid(shm::PortInstance away, const RegistryEntry& entry) {
    return away != 0 ? std::optional(entry.owner().process.pid) : std::nullopt;
  }

  [[nodiscard]] wire::SourceStatus source(const Source& source) const {
    wire::SourceStatus result;
    result.name = source.name;
    result.mentioned = snapshot_.table.knows_source(source.id);
    result.active = is_active(source);
    result.timeout = snapshot_.table.timeout(source.id);
    result.away_pid = away_pid(source.away, of_.registry.source(source.id));
    const OutputPort* output = of_.switchboard.output(source.open);
    if (output != nullptr) result.open = open_output(*output);
    return result;
  }

  [[nodiscard]] wire::OpenOutput open_output(const OutputPort& output) const {
    const auto& counters = output.header().counters;
    std::vector<wire::Component> taps;
    for (const Tap* tap : of_.switchboard.taps_of(output.instance)) {
      taps.push_back(component_of(*tap->client));
    }
    return {component_of(*output.client), std::move(taps),
            type_of(output.type),         output.type.size,
            read(counters.published),     read(counters.signals),
            read(counters.delivered),     read(counters.discarded),
            read(counters.refused),       read(counters.blind),
            read(counters.unsettled),     read(counters.no_slot),
            read(counters.late),          text_of(output.described.text),
            trouble_of(output.described)};
  }

  wire::InputStatus input(const InputName& name) {
    const InputPort* input = of_.switchboard.input(name.open);
    std::string why_not;
    const shm::Command command = command_at(name.id, input, why_not);
    wire::InputStatus result;
    result.name = name.name;
    result.mentioned = snapshot_.table.knows_port(name.id);
    result.arbitrated = snapshot_.table.is_arbitrated(name.id);
    result.in_order = is_decided_in_order(name.id);
    result.idle = command.commander.source == shm::kNone;
    if (result.arbitrated && !result.idle) {
      result.winner = of_.names.sources()[command.commander.source]->name;
    }
    if (result.idle && command.selected.source != shm::kNone) {
      result.cannot_deliver = {of_.names.sources()[command.selected.source]->name, why_not};
    }
    result.away_pid = away_pid(name.away, of_.registry.input(name.id));
    if (input != nullptr) result.open = open_input(*input);
    add_connections(name, input, result);
    return result;
  }

  static wire::OpenInput open_input(const InputPort& input) {
    const shm::InputHeader& header = input.shared().header;
    return {component_of(*input.client),
            type_of(input.type),
            header.depth,
            header.keep != 0,
            header.refuse_new != 0 ? wire::WhenFull::kRefuseNew : wire::WhenFull::kDropOldest,
            read(header.counters.taken),
            read(header.counters.dropped),
            read(header.counters.overtaken),
            read(header.counters.blind),
            read(header.counters.unsettled),
            read(header.counters.misbehaved),
            read(header.counters.idles),
            text_of(input.described.text),
            trouble_of(input.described)};
  }

  void add_connections(const InputName& name, const InputPort* input, wire::InputStatus& result) {
    std::set<shm::SourceId> connected;
    const auto range = snapshot_.table.connections_to(name.id);
    for (auto index = range.first; index != range.first + range.count; ++index) {
      const shm::SourceId id = snapshot_.table.rule(index).source;
      const auto* source =
          id < of_.names.sources().size() ? of_.names.sources()[id].get() : nullptr;
      if (source == nullptr) continue;
      connected.insert(id);
      const OutputPort* output = of_.switchboard.output(source->open);
      const Link* link = link_between(output, input);
      wire::ConnectionStatus connection;
      connection.source = source->name;
      connection.active = is_active(*source);
      connection.winner = result.winner == source->name;
      connection.output = end_of(output, source->away);
      connection.input = end_of(input, name.away);
      if (link != nullptr && !link->mismatch.empty()) connection.mismatch = link->mismatch;
      const std::uint64_t lost = add_counters(output, input, link, connection);
      if (result.open) result.open->overtaken += lost;
      result.connections.push_back(std::move(connection));
    }
    const auto senses = snapshot_.table.sources_read(name.id);
    for (shm::Word i = 0; i < senses.count; ++i) {
      if (connected.count(senses[i]) != 0 || senses[i] >= of_.names.sources().size()) continue;
      const Source& source = *of_.names.sources()[senses[i]];
      result.senses.push_back({source.name, is_active(source)});
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

  // `why_not`: why the first that is selected cannot deliver.
  [[nodiscard]] shm::Command command_at(shm::PortId port, const InputPort* input,
                                        std::string& why_not) const {
    shm::DecisionClock clock(now_, true);
    shm::PortPicture picture;
    picture.bind(snapshot_.table, port, of_.names.pages());
    static_cast<void>(picture.take(clock));  // else nobody is active in it
    return picture.command([&](const shm::Rule& rule) {
      std::string why = why_nothing_can_come(rule.source, input);
      const bool can_deliver = why.empty();
      if (why_not.empty()) why_not = std::move(why);
      return can_deliver;
    });
  }

  // Of an active source. Empty: something can.
  [[nodiscard]] std::string why_nothing_can_come(shm::SourceId id, const InputPort* input) const {
    const Source& source = *of_.names.sources()[id];
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
  return wire::write_document(wire::to_json(Document(of, now).build()));  // names may be any bytes
}

}  // namespace arbiter::service
