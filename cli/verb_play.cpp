// arbiter play: publishes a trace to the running daemon's ports, in real time, and tells what
// became of it in the form of `arbiter simulate`.
//
// Each arrival bears the time that the trace gives it, counted from the start, not the moment at
// which the scheduler let us run; so what simulate says of a boundary holds here too.
#include <algorithm>
#include <chrono>
#include <cmath>
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
#include "rules/ask/report.hpp"
#include "rules/explain/simulation.hpp"
#include "rules/explain/trace.hpp"
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

class Player {
 public:
  Player(const PlayOptions& options, const std::vector<rules::TraceEvent>& events)
      : options_(options), node_("arbiter-play", node_options(options.instance)) {
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

  // False: interrupted.
  bool run(const std::vector<rules::TraceEvent>& events, const shm::FileDescriptor& interrupts) {
    const shm::Nanoseconds start = shm::monotonic_now() + kLead;
    for (const auto& event : events) {
      const auto since_first = static_cast<double>(event.at - events.front().at);
      const shm::Nanoseconds at =
          start + (options_.speed == 1 ? event.at - events.front().at
                                       : std::llround(since_first / options_.speed));
      last_ = time_of(event, at);
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
      outputs_.at(event.source).publish_at(Time(std::chrono::nanoseconds(at)), counter_);
    } else if (event.kind == rules::TraceKind::kDeactivation) {
      outputs_.at(event.source).deactivate_at(Time(std::chrono::nanoseconds(at)));
    }
    instance_->update();
    for (const auto& [name, port] : ports_of(event)) {
      rules::write_outcome(std::cout, {event, name, outcome_at(port, event, at)});
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

  // By the live tables and activities, whether or not a component has the port open.
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

  const PlayOptions& options_;
  Node node_;
  std::map<std::string, OutputPort<std::uint64_t>> outputs_;
  std::shared_ptr<watch::Instance> instance_;
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
  Player player(options, events);
  player.note_unknown_sources();
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
      "Exit codes: 0 all published; 1 no daemon, or the trace has errors; 2 wrong use, or a file "
      "that "
      "cannot\nbe read; 130 stopped by Ctrl-C before the end (143 by SIGTERM)");
  verb->callback([options, &exit_code] { exit_code = play(*options); });
}

}  // namespace arbiter::cli
