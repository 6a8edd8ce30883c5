// arbiter play: publishes a trace to the running daemon's ports, in real time, and tells what
// became of it in the form of `arbiter simulate`.
//
// Each arrival bears the time that the trace gives it, counted from the start, not the moment at
// which the scheduler let us run; so what simulate says of a boundary holds here too.
#include <algorithm>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <iostream>
#include <map>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include <CLI/CLI.hpp>

#include "cli/live.hpp"
#include "cli/model_files.hpp"
#include "cli/numbers.hpp"
#include "cli/pub_type.hpp"
#include "cli/verbs.hpp"
#include "recorder/speed.hpp"
#include "rules/ask/report.hpp"
#include "rules/explain/simulation.hpp"
#include "rules/explain/trace.hpp"
#include "rules/text/names.hpp"
#include "shm/clock.hpp"
#include "shm/port_picture.hpp"
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

// An output port, and its tap: Outcome counts ports, and a tap names them. Where components want
// samples of a type, all bytes are zero, which is what a robot stands still by; else it is a number
// that counts.
class PlayedSource {
 public:
  PlayedSource(Node& node, const std::string& name, const std::optional<Type>& type)
      : sample_(type ? type->size() : sizeof(std::uint64_t)),
        is_number_(!type),
        output_(node.output_port(name, type.value_or(arbiter::type_of<std::uint64_t>()))),
        tap_(tap_of(node, name)) {
    output_.require_replay();
  }

  void publish_at(Time at, std::uint64_t number) {
    last_.reset();
    if (is_number_) std::memcpy(sample_.data(), &number, sizeof number);
    output_.publish_at(at, Bytes(sample_.data(), sample_.size()));
    while (auto event = tap_.take()) {
      if (event->kind() == TapEventKind::sample) last_.emplace(std::move(*event));
    }
  }
  void deactivate_at(Time at) { output_.deactivate_at(at); }

  // What became of the last sample at an input port that the model connects to this source.
  [[nodiscard]] rules::PortOutcome outcome_at(const std::string& port) const {
    if (!last_) return {false, {}, "?"};
    switch (last_->at(port)) {
      case Fate::accepted:
        return {true, {}};
      case Fate::discarded:
        return {};
      case Fate::refused:
        return {false, {}, "refused"};
      case Fate::blind:
        return {false, {}, "blind"};
      case Fate::none:
        break;
    }
    return {false, {}, "not open"};
  }

 private:
  static Tap<> tap_of(Node& node, const std::string& name) {
    TapOptions options;
    options.max_held = 0;
    options.may_wait = false;
    return node.tap(name, options);
  }

  std::vector<std::byte> sample_;
  const bool is_number_;
  OutputPort<void> output_;
  Tap<> tap_;
  std::optional<TapEvent<>> last_;  // nothing: the tap has told nothing of the last sample
};

class Player {
 public:
  Player(const PlayOptions& options, const std::vector<rules::TraceEvent>& events)
      : options_(options),
        node_("arbiter-play", node_options(options.instance)),
        instance_(watch_instance("play", options.instance)) {
    const wire::Status status = instance_->status();
    for (const auto& event : events) {
      if (event.kind == rules::TraceKind::kTick || sources_.count(event.source) != 0) continue;
      sources_.try_emplace(event.source, node_, event.source,
                           type_of_receivers(status, event.source));
    }
    instance_->update();  // now it sees what has been opened
  }
  Player(const Player&) = delete;
  Player& operator=(const Player&) = delete;

  void note_unknown_sources() const {
    const auto table = instance_->memory()->tables().snapshot().table;
    for (const auto& [name, played] : sources_) {
      const auto source = instance_->find_source(name);
      if (source && table.knows_source(*source)) continue;
      std::cerr << "arbiter: note: the daemon's model does not know " << name << '\n';
    }
  }

  // Notices name the ports that refuse the sources.
  void note_what_is_not_open() const {
    const wire::Status status = instance_->status();
    for (const wire::InputStatus& input : status.inputs) {
      if (input.open) continue;
      std::set<std::string> connected;
      for (const auto& connection : input.connections) {
        if (sources_.count(connection.source) != 0) connected.insert(connection.source);
      }
      if (connected.empty()) continue;
      std::cerr << "arbiter: no component has " + input.name +
                       " open, which the model connects to " +
                       rules::enumerate({connected.begin(), connected.end()}) +
                       ", so that nothing is delivered there\n";
    }
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
    const Time time{std::chrono::nanoseconds(at)};
    if (event.kind == rules::TraceKind::kArrival) {
      sources_.at(event.source).publish_at(time, ++counter_);
    } else if (event.kind == rules::TraceKind::kDeactivation) {
      sources_.at(event.source).deactivate_at(time);
    }
    instance_->update();
    const auto table = instance_->memory()->tables().snapshot().table;
    const auto own = instance_->find_source(event.source);
    for (const auto& [name, port] : ports_of(event, table)) {
      const bool is_connected = own && table.find(*own, port) != shm::kNone;
      rules::PortOutcome outcome;
      if (event.kind == rules::TraceKind::kArrival && is_connected) {
        outcome = sources_.at(event.source).outcome_at(name);
      }
      outcome.winner = winner_at(port, at);
      rules::write_outcome(std::cout, {event, name, std::move(outcome)});
    }
  }

  // In byte order of their names.
  [[nodiscard]] std::map<std::string, shm::PortId> ports_of(const rules::TraceEvent& event,
                                                            const shm::TableView& table) const {
    std::map<std::string, shm::PortId> result;
    const auto& names = instance_->port_names();
    if (event.kind != rules::TraceKind::kArrival) {
      for (const auto& [port, name] : names) {
        if (table.is_arbitrated(port)) result[name] = port;
      }
    } else if (const auto source = instance_->find_source(event.source)) {
      const auto ports = table.ports_concerned(*source);
      for (shm::Word i = 0; i < ports.count; ++i) {
        const auto named = names.find(ports[i]);
        if (named != names.end()) result[named->second] = named->first;
      }
    }
    return result;
  }

  // By the live tables and activities, whether or not a component has the port open.
  [[nodiscard]] std::string winner_at(shm::PortId port, shm::Nanoseconds at) const {
    const shm::DecisionMemory& memory = *instance_->memory();
    watch::Picture picture = watch::take_picture(memory, watch::sources_at(port));
    picture.now = at;
    const shm::SourceId winner = picture.winner_at(port);
    return winner == shm::kNone ? std::string() : memory.source_name(winner);
  }

  const PlayOptions& options_;
  Node node_;
  const std::shared_ptr<watch::Instance> instance_;
  std::map<std::string, PlayedSource> sources_;
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
  verb->add_option("TRACE", options->trace,
                   "CSV: t_ns,source or t_ns,source,event; -: standard input")
      ->transform(dash_for_input())
      ->required();
  verb->add_option("--speed", options->speed, "How many times faster than the trace (default 1)")
      ->type_name("X")
      ->check(number_between(1e-3, 1e6));
  add_instance_option(*verb, options->instance);
  verb->footer(
      "Example:\n  arbiter play trace.csv --speed 2\n\n"
      "Samples are of the type that the input ports take that are open at the start, and all zero; "
      "where these\nare untyped or of several types, they are numbers that count.\n\n"
      "The decision says what became of the sample, which play learns from a tap of each source: "
      "the policy\nmust allow `replay` and `tap` of them. Beside delivered and discarded it may "
      "be: "
      "`not open`, no\ncomponent has the input port open; `refused`, its queue is full, or the "
      "types differ; `blind`, no\ndecision was taken; `?`, there was no memory for the tap.\n\n"
      "Exit codes: 0 all published; 1 no daemon, or the trace has errors; 2 wrong use, or a file "
      "that "
      "cannot\nbe read; 130 stopped by Ctrl-C before the end (143 by SIGTERM)");
  verb->callback([options, &exit_code] { exit_code = play(*options); });
}

}  // namespace arbiter::cli
