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
#include <vector>

#include <CLI/CLI.hpp>

#include "cli/live.hpp"
#include "cli/verbs.hpp"
#include "rules/ask/report.hpp"
#include "rules/explain/simulation.hpp"
#include "rules/explain/trace.hpp"
#include "shm/clock.hpp"

namespace arbiter::cli {
namespace {

// The first event comes this long after the ports are open.
constexpr shm::Nanoseconds kLead = 10'000'000;

struct PlayOptions {
  std::string trace;
  std::string instance;
  double speed = 1;
};

class Player {
 public:
  Player(const PlayOptions& options, const std::vector<rules::TraceEvent>& events)
      : options_(options), node_(connect("play", options.instance)), memory_(node_->memory()) {
    shm::Message observe;
    observe.kind = shm::MessageKind::kObserve;
    static_cast<void>(node_->ask(observe, {-1, -1}));
    for (const auto& event : events) {
      if (event.kind == rules::TraceKind::kTick || outputs_.count(event.source) != 0) continue;
      outputs_[event.source] =
          node_->open_output(event.source, type_of<std::uint64_t>(), OutputPortOptions{});
      outputs_[event.source]->require_replay();
    }
  }
  Player(const Player&) = delete;
  Player& operator=(const Player&) = delete;
  ~Player() {
    for (auto& [name, output] : outputs_) detail::close_output(std::move(output));
  }

  void note_unknown_sources() const {
    const auto table = memory_->tables().snapshot().table;
    for (const auto& [name, output] : outputs_) {
      if (table.knows_source(output->source())) continue;
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
    detail::OutputCore* output = nullptr;
    if (event.kind != rules::TraceKind::kTick) output = outputs_.at(event.source).get();
    if (event.kind == rules::TraceKind::kArrival) {
      ++counter_;
      detail::publish_copy_at(*output, Time(std::chrono::nanoseconds(at)), &counter_,
                              sizeof counter_);
    } else if (output != nullptr) {
      detail::deactivate_at(*output, Time(std::chrono::nanoseconds(at)));
    }
    const shm::TableSnapshot snapshot = memory_->tables().snapshot();
    for (const auto& [name, port] : ports_of(event, output, snapshot.table)) {
      rules::write_outcome(std::cout,
                           {event, name, outcome_at(port, event, output, snapshot.table, at)});
    }
  }

  // In byte order of their names.
  std::map<std::string, shm::PortId> ports_of(const rules::TraceEvent& event,
                                              const detail::OutputCore* output,
                                              const shm::TableView& table) {
    std::map<std::string, shm::PortId> ports;
    const auto names = node_->port_names();
    if (event.kind == rules::TraceKind::kArrival) {
      const auto concerned = table.ports_concerned(output->source());
      for (shm::Word i = 0; i < concerned.count; ++i) {
        if (const auto name = names.find(concerned[i]); name != names.end()) {
          ports[name->second] = name->first;
        }
      }
      return ports;
    }
    for (const auto& [port, name] : names) {
      if (table.is_arbitrated(port)) ports[name] = port;
    }
    return ports;
  }

  // By the live tables and activities, whether or not a component has the port open.
  rules::PortOutcome outcome_at(shm::PortId port, const rules::TraceEvent& event,
                                const detail::OutputCore* output, const shm::TableView& table,
                                shm::Nanoseconds at) const {
    shm::DecisionClock clock(at, true);
    shm::Decider decider(table, memory_->pages(), clock);
    rules::PortOutcome outcome;
    if (event.kind == rules::TraceKind::kArrival && output != nullptr) {
      const shm::Rule own = table.rule(table.find(output->source(), port));
      outcome.delivered = decider.decide(own) == shm::Verdict::kWins;
    }
    const auto range = table.connections_to(port);
    for (auto index = range.first; index != range.first + range.count; ++index) {
      const shm::Rule rule = table.rule(index);
      if (decider.decide_with_own(rule) != shm::Verdict::kWins) continue;
      outcome.winner = memory_->source_name(rule.source);
      break;
    }
    return outcome;
  }

  const PlayOptions& options_;
  std::shared_ptr<detail::NodeCore> node_;
  const std::shared_ptr<const detail::SharedMemory> memory_;
  std::map<std::string, std::shared_ptr<detail::OutputCore>> outputs_;
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
  return events.empty() || player.run(events, interrupts) ? 0 : 1;
}

}  // namespace

void add_play(CLI::App& app, int& exit_code) {
  const auto options = std::make_shared<PlayOptions>();
  CLI::App* verb =
      app.add_subcommand("play", "Publish a trace in real time, and tell who was heard");
  verb->add_option("TRACE", options->trace, "CSV: t_ns,source or t_ns,source,event")->required();
  verb->add_option("--speed", options->speed, "How many times faster than the trace (default 1)")
      ->type_name("X")
      ->check(CLI::Range(1e-3, 1e6));
  add_instance_option(*verb, options->instance);
  verb->footer("Example:\n  arbiter play trace.csv --speed 2");
  verb->callback([options, &exit_code] { exit_code = play(*options); });
}

}  // namespace arbiter::cli
