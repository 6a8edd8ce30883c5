// arbiter play: publishes a trace to the running daemon's ports, in real time, and tells what
// became of it in the form of `arbiter simulate`.
//
// Each arrival bears the time that the trace gives it, counted from the start, not the moment at
// which the scheduler let us run; so what simulate says of a boundary holds here too.
#include <algorithm>
#include <chrono>
#include <cstdint>
#include <iostream>
#include <map>
#include <memory>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include <CLI/CLI.hpp>

#include "cli/live.hpp"
#include "cli/numbers.hpp"
#include "cli/verbs.hpp"
#include "recorder/speed.hpp"
#include "rules/ask/report.hpp"
#include "rules/explain/simulation.hpp"
#include "rules/explain/trace.hpp"
#include "rules/text/names.hpp"
#include "shm/clock.hpp"
#include "shm/picture.hpp"
#include "watch/instance.hpp"
#include "watch/picture.hpp"

namespace arbiter::cli {
namespace {

// The first event comes this long after the ports are open.
constexpr shm::Nanoseconds kLead = 10'000'000;

struct PlayOptions {
  std::string trace;
  std::string instance;
  double speed = 1;
};

// Of names that the model does not mention play speaks itself.
NodeOptions node_options(const std::string& instance) {
  NodeOptions options = live_options(instance);
  options.on_notice = [say = std::move(options.on_notice)](const Notice& notice) {
    if (notice.kind != NoticeKind::unmentioned) say(notice);
  };
  return options;
}

// Who has the input ports open that the model connects the trace's sources to. Looked at anew where
// a source meets another number of them than before.
class PlayedPorts {
 public:
  explicit PlayedPorts(const std::string& instance) : caller_(caller("play", instance)) {}

  void look() {
    next_look_ = shm::monotonic_now() + kLookAgain;
    is_stale_ = false;
    try {
      status_ = fetch_status(caller_, kPatience);
    } catch (const wire::CallError&) {
      // The daemon has gone, or is busy: what was so is taken to be so.
    }
  }

  // `met`: at how many input ports something became of an arrival of the source.
  void note_arrival(const std::string& source, std::uint32_t met) {
    const auto known = met_.try_emplace(source, open_inputs_of(source)).first;
    is_stale_ = std::exchange(known->second, met) != met || is_stale_;
    if (is_stale_ && shm::monotonic_now() >= next_look_) look();
  }

  // "not open", "refused"; empty: nothing hinders it.
  [[nodiscard]] std::string hindrance(const std::string& source, const std::string& port) const {
    const wire::InputStatus* const input = status_.find_input(port);
    if (input == nullptr || !input->open) return "not open";
    const auto* const connection = connection_of(*input, source);
    return connection != nullptr && connection->mismatch ? "refused" : "";
  }

  // Of these sources. Ports that refuse them, notices name.
  void say_what_is_not_open(const std::set<std::string>& sources) const {
    for (const wire::InputStatus& input : status_.inputs) {
      std::vector<std::string> connected;
      for (const std::string& source : sources) {
        if (connection_of(input, source) != nullptr) connected.push_back(source);
      }
      if (input.open || connected.empty()) continue;
      std::cerr << "arbiter: no component has " + input.name +
                       " open, which the model connects to " + rules::enumerate(connected) +
                       ", so that nothing is delivered there\n";
    }
  }

 private:
  // The daemon is not asked more often, and does not hold up the trace for longer.
  static constexpr shm::Nanoseconds kLookAgain = 1'000'000'000;
  static constexpr std::chrono::milliseconds kPatience{100};

  static const wire::ConnectionStatus* connection_of(const wire::InputStatus& input,
                                                     const std::string& source) {
    const auto found = std::find_if(input.connections.begin(), input.connections.end(),
                                    [&](const auto& each) { return each.source == source; });
    return found == input.connections.end() ? nullptr : &*found;
  }

  [[nodiscard]] std::uint32_t open_inputs_of(const std::string& source) const {
    return static_cast<std::uint32_t>(std::count_if(
        status_.inputs.begin(), status_.inputs.end(),
        [&](const auto& input) { return input.open && connection_of(input, source) != nullptr; }));
  }

  const wire::Caller caller_;
  wire::Status status_;
  std::map<std::string, std::uint32_t> met_;  // by source: at its last arrival
  bool is_stale_ = false;
  shm::Nanoseconds next_look_ = 0;
};

class Player {
 public:
  Player(const PlayOptions& options, const std::vector<rules::TraceEvent>& events)
      : options_(options),
        node_("arbiter-play", node_options(options.instance)),
        played_ports_(options.instance) {
    for (const auto& event : events) {
      if (event.kind == rules::TraceKind::kTick || outputs_.count(event.source) != 0) continue;
      outputs_.emplace(event.source, node_.output_port<std::uint64_t>(event.source))
          .first->second.require_replay();
    }
    instance_ = watch_instance("play", options.instance);  // which sees what has been opened
  }
  Player(const Player&) = delete;
  Player& operator=(const Player&) = delete;

  void note_unknown_sources() const {
    const auto table = instance_->memory()->tables().snapshot().table;
    for (const auto& [name, output] : outputs_) {
      const auto source = instance_->find_source(name);
      if (source && table.knows_source(*source)) continue;
      std::cerr << "arbiter: note: the daemon's model does not know " << name << '\n';
    }
  }

  void note_what_is_not_open() {
    played_ports_.look();
    std::set<std::string> sources;
    for (const auto& [name, output] : outputs_) sources.insert(name);
    played_ports_.say_what_is_not_open(sources);
  }

  // False: interrupted.
  bool run(const std::vector<rules::TraceEvent>& events, const shm::FileDescriptor& interrupts) {
    const shm::Nanoseconds start = shm::monotonic_now() + kLead;
    for (const auto& event : events) {
      const shm::Nanoseconds since_first = event.at - events.front().at;
      last_ = time_of(event, start + recorder::at_speed(since_first, options_.speed));
      if (sleep_until(last_, interrupts)) return false;
      play(event, last_);
      std::cout.flush();
      if (!std::cout) return false;
    }
    return true;
  }

 private:
  // At the moment of its deactivation a source can arrive no more (OutputPort::publish_at()): the
  // trace goes on a nanosecond later.
  shm::Nanoseconds time_of(const rules::TraceEvent& event, shm::Nanoseconds at) {
    at = std::max(at, last_);
    const auto deactivated = deactivated_.find(event.source);
    if (deactivated != deactivated_.end() && deactivated->second == at) ++at;
    if (event.kind == rules::TraceKind::kDeactivation) deactivated_[event.source] = at;
    return at;
  }

  void play(const rules::TraceEvent& event, shm::Nanoseconds at) {
    if (event.kind == rules::TraceKind::kArrival) {
      ++counter_;
      const Outcome outcome =
          outputs_.at(event.source).publish_at(Time(std::chrono::nanoseconds(at)), counter_);
      played_ports_.note_arrival(event.source,
                                 outcome.delivered + outcome.discarded + outcome.refused);
    } else if (event.kind == rules::TraceKind::kDeactivation) {
      outputs_.at(event.source).deactivate_at(Time(std::chrono::nanoseconds(at)));
    }
    instance_->update();
    for (const auto& [name, port] : ports_of(event)) {
      rules::PortOutcome outcome = outcome_at(port, event, at);
      if (is_connected(event, port))
        outcome.hindrance = played_ports_.hindrance(event.source, name);
      rules::write_outcome(std::cout, {event, name, std::move(outcome)});
    }
  }

  // In byte order of their names.
  [[nodiscard]] std::map<std::string, shm::PortId> ports_of(const rules::TraceEvent& event) const {
    const auto table = instance_->memory()->tables().snapshot().table;
    std::set<shm::PortId> concerned;
    const bool is_arrival = event.kind == rules::TraceKind::kArrival;
    if (const auto source = instance_->find_source(event.source); is_arrival && source) {
      const auto ports = table.ports_concerned(*source);
      for (shm::Word i = 0; i < ports.count; ++i) concerned.insert(ports[i]);
    }
    std::map<std::string, shm::PortId> result;
    for (const auto& [port, name] : instance_->port_names()) {
      if (is_arrival ? concerned.count(port) != 0 : table.is_arbitrated(port)) result[name] = port;
    }
    return result;
  }

  // By the live tables and activities: who wins, whether or not a component has the port open.
  [[nodiscard]] rules::PortOutcome outcome_at(shm::PortId port, const rules::TraceEvent& event,
                                              shm::Nanoseconds at) const {
    const shm::DecisionMemory& memory = *instance_->memory();
    watch::Picture picture = watch::take_picture(memory, watch::sources_at(port));
    picture.now = at;
    const shm::TableView& table = picture.snapshot.table;
    const auto is_active = [&](shm::SourceId source) { return picture.is_active(source); };
    const shm::SourceId winner = shm::selected_at(table, port, is_active).source;
    rules::PortOutcome outcome;
    if (winner != shm::kNone) outcome.winner = memory.source_name(winner);
    if (event.kind != rules::TraceKind::kArrival) return outcome;
    const auto own = instance_->find_source(event.source);
    outcome.delivered = own && table.find(*own, port) != shm::kNone &&
                        (winner == *own || !table.is_arbitrated(port));
    return outcome;
  }

  // An arrival, by the model in force.
  [[nodiscard]] bool is_connected(const rules::TraceEvent& event, shm::PortId port) const {
    if (event.kind != rules::TraceKind::kArrival) return false;
    const auto own = instance_->find_source(event.source);
    const auto table = instance_->memory()->tables().snapshot().table;
    return own && table.find(*own, port) != shm::kNone;
  }

  const PlayOptions& options_;
  Node node_;
  std::map<std::string, OutputPort<std::uint64_t>> outputs_;
  std::shared_ptr<watch::Instance> instance_;
  PlayedPorts played_ports_;
  std::map<std::string, shm::Nanoseconds> deactivated_;  // when last
  shm::Nanoseconds last_ = 0;                            // time of the last event
  std::uint64_t counter_ = 0;
};

int play(const PlayOptions& options) {
  const auto interrupts = catch_interrupts();
  rules::Diagnostics diagnostics;
  const auto events = rules::read_trace(options.trace, diagnostics);
  rules::write_text(std::cerr, diagnostics);
  if (diagnostics.has_errors()) return 1;
  if (!events.empty()) {
    recorder::require_end(options.trace, events.back().at - events.front().at, options.speed);
  }
  Player player(options, events);
  player.note_unknown_sources();
  player.note_what_is_not_open();
  rules::write_outcome_header(std::cout);
  if (events.empty() || player.run(events, interrupts)) return 0;
  return std::cout ? interrupted_exit_code(interrupts) : 1;
}

}  // namespace

void add_play(CLI::App& app, int& exit_code) {
  const auto options = std::make_shared<PlayOptions>();
  CLI::App* verb =
      app.add_subcommand("play", "Publish a trace in real time, and show what was delivered");
  verb->add_option("TRACE", options->trace, "CSV: t_ns,source or t_ns,source,event")->required();
  verb->add_option("--speed", options->speed, "How many times faster than the trace (default 1)")
      ->type_name("X")
      ->check(number_between(1e-3, 1e6));
  add_instance_option(*verb, options->instance);
  verb->footer(
      "Example:\n  arbiter play trace.csv --speed 2\n\n"
      "Beside delivered and discarded, as of arbiter simulate, the decision may be `not open`: no "
      "component\nhas the input port open; or `refused`: the connection is, as where the types "
      "differ.\n\n"
      "Exit codes: 0 all published; 1 no daemon, or the trace has errors; 2 wrong use, or a file "
      "that "
      "cannot\nbe read; 130 stopped by Ctrl-C before the end (143 by SIGTERM)");
  verb->callback([options, &exit_code] { exit_code = play(*options); });
}

}  // namespace arbiter::cli
