// In which states two models decide differently: proved over all states of the sources, counted
// exactly, and shown by examples.
//
// Two models decide alike iff their connections are the same, the same ports are arbitrated, the
// same connection wins in every state, and each source stays active for as long. What behaviours
// are called, and in which order they stand, does not matter.
//
// Thread safety: diff() uses decision diagrams, of which there is one instance in a process; other
// threads that want it wait (rules/prove/diagram.hpp).
#pragma once

#include <cstddef>
#include <optional>
#include <ostream>
#include <string>
#include <vector>

#include "rules/prove/budget.hpp"
#include "rules/prove/compile.hpp"
#include "rules/text/diagnostic.hpp"

namespace arbiter::rules {

struct ModelDiff {
  // All states in which `before` wins in the one model, and `after` in the other.
  struct Change {
    std::optional<std::string> before, after;  // winners; none: nobody wins
    std::string states;              // how many, decimal and exact, of PortDiff::of; if counted
    std::optional<Witness> example;  // none if a bound was met
  };

  struct PortDiff {
    std::string port;
    bool exists_before = true, exists_after = true;  // has connections
    bool arbitrated_before = true, arbitrated_after = true;
    bool first_wins_before = false, first_wins_after = false;  // conflict="first"
    std::vector<std::string> connections_before;  // sources connected in that model only
    std::vector<std::string> connections_after;
    std::vector<std::string> reads_before;  // sources that rules read in that model only; a port
    std::vector<std::string> reads_after;   // of both, where they are not connected

    // Of a port that both arbitrate.
    std::size_t sources = 0;      // connected or read there, in either model
    std::string states = "0";     // in which different connections win, decimal and exact
    std::string of = "0";         // 2^sources
    std::vector<Change> changes;  // most states first
    // Where the diagrams are too large, states of change are searched one by one. Then they are not
    // counted, and there may be more changes than those found.
    bool is_counted = true;
    bool is_complete = true;
    std::string open;  // why no proof was found, and `states` is not known; empty if one was

    // In what is decided; conflict="first" by itself is none.
    [[nodiscard]] bool differs() const;
  };

  struct TimeoutChange {
    std::string source;  // empty: of all that have no timeout of their own
    shm::Nanoseconds before, after;
  };

  std::vector<PortDiff> ports;  // those of which something can be said, in byte order
  std::vector<TimeoutChange> timeouts;
  std::size_t compared_ports = 0;  // of both models together

  [[nodiscard]] bool differs() const;
  // Nothing differs as far as is known, but some port could not be compared within the bounds.
  [[nodiscard]] bool is_open() const;
};

// Shares out what is left of the budget among the ports. Throws Stopped.
ModelDiff diff(const CompiledModel& before, const CompiledModel& after, Budget& budget);

// For people. Says "no difference" where there is none.
void write_text(std::ostream& out, const ModelDiff& diff);
// docs/checking.md has the fields.
void write_json(std::ostream& out, const ModelDiff& diff);
// One line, for a log: "1 of 2 ports decides differently (/Arm/pos:i); 1 timeout changed".
std::string summary(const ModelDiff& diff);

}  // namespace arbiter::rules
