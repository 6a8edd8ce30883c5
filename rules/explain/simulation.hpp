// Replays a trace against the very tables and decision code that run live, with an injected clock.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <ostream>
#include <string>
#include <unordered_map>
#include <vector>

#include "rules/explain/trace.hpp"
#include "rules/prove/compile.hpp"
#include "shm/port_picture.hpp"

namespace arbiter::rules {

// What came of an event at one port.
struct PortOutcome {
  bool delivered = false;  // of an arrival
  std::string winner;      // the source selected afterwards; empty if none is
  // Of an arrival at a port of a running daemon: why it gets nothing, whatever the rules decide.
  // Empty: nothing hinders it.
  std::string hindrance{};
};

// A line of the result: t_ns,source,destination,decision,winner.
struct OutcomeRow {
  const TraceEvent& event;
  const std::string& port;
  PortOutcome outcome;
};

void write_outcome_header(std::ostream& out);
void write_outcome(std::ostream& out, const OutcomeRow& row);

class Simulation {
 public:
  explicit Simulation(const CompiledModel& model);

  [[nodiscard]] bool knows(const std::string& source) const { return ids_.contains(source); }

  [[nodiscard]] shm::SourceId source_id(const std::string& source) const { return ids_.at(source); }
  // Nothing: the model does not have it.
  [[nodiscard]] std::optional<shm::PortId> find_port(const std::string& port) const;

  // The ports that an event has a row for, in byte order: those that an arrival's source is
  // connected to or that read it, for anything else each arbitrated port.
  [[nodiscard]] std::vector<shm::PortId> ports_of(const TraceEvent& event) const;
  [[nodiscard]] const std::string& port_name(shm::PortId port) const { return ports_[port]; }

  // Takes an event, the time of which must not fall, and says what came of it at each of its ports.
  std::vector<OutcomeRow> step(const TraceEvent& event);

  // For recordings: what a source is like, and what would become of an arrival at this moment. The
  // connection must be one that find() of the table gives.
  void set_activity(shm::SourceId source, shm::ActivityWord word) {
    activity_[source].word.store(word, std::memory_order_relaxed);
  }
  [[nodiscard]] bool is_delivered(const shm::Rule& rule);

  // Lets time pass without an event; it must not fall.
  void advance_to(shm::Nanoseconds time) { clock_.now = time; }

  // The state, for those who explain it.
  [[nodiscard]] shm::Nanoseconds now() const { return clock_.now; }
  [[nodiscard]] const shm::TableView& table() const { return table_; }
  [[nodiscard]] std::size_t source_count() const { return sources_.size(); }
  [[nodiscard]] const std::string& source_name(shm::SourceId source) const {
    return sources_[source];
  }
  [[nodiscard]] shm::ActivityWord activity(shm::SourceId source) const {
    return activity_[source].word.load(std::memory_order_relaxed);
  }
  [[nodiscard]] bool is_active(shm::SourceId source) const {
    return shm::is_active(activity(source), clock_.now);
  }
  // The source that the port selects; shm::kNone: none.
  [[nodiscard]] shm::SourceId winner_at(shm::PortId port) const;
  [[nodiscard]] const std::vector<std::string>& port_names() const { return ports_; }  // by id

 private:
  struct Clock {
    shm::Nanoseconds now = 0;
    [[nodiscard]] shm::Nanoseconds reading() const { return now; }
    [[nodiscard]] bool is_fresh() const { return true; }
    void read() {}
  };

  void apply(const TraceEvent& event);
  PortOutcome outcome_at(shm::PortId port, const TraceEvent& event);

  std::vector<std::string> sources_;  // by id
  std::vector<std::string> ports_;    // by id; ids follow byte order
  std::unordered_map<std::string, shm::SourceId> ids_;
  std::vector<shm::Atomic<shm::Word>> words_;
  shm::TableView table_;
  std::vector<shm::Activity> activity_;  // by source id
  std::unique_ptr<shm::ActivityPages> pages_;
  Clock clock_;
};

}  // namespace arbiter::rules
