// Replays a trace against the very tables and decision code that run live, with an injected clock.
#pragma once

#include <cstdint>
#include <memory>
#include <ostream>
#include <string>
#include <unordered_map>
#include <vector>

#include "rules/compile.hpp"
#include "rules/trace.hpp"
#include "shm/decision.hpp"

namespace arbiter::rules {

// What came of an event at one port.
struct PortOutcome {
  bool delivered = false;  // of an arrival
  std::string winner;      // the source selected afterwards; empty if none is
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

  // The ports that an event has a row for, in byte order: those that an arrival's source is
  // connected to or that read it, for anything else each arbitrated port.
  [[nodiscard]] std::vector<shm::PortId> ports_of(const TraceEvent& event) const;
  [[nodiscard]] const std::string& port_name(shm::PortId port) const { return ports_[port]; }

  // Takes an event, the time of which must not fall, and says what came of it at each of its ports.
  std::vector<OutcomeRow> step(const TraceEvent& event);

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
