// What would have happened under another model: the same arrivals and deactivations, with other
// rules and other times of activity.
#pragma once

#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "evidence/judge.hpp"
#include "evidence/models.hpp"
#include "evidence/recorded.hpp"
#include "evidence/verification.hpp"

namespace arbiter::evidence {

struct ChangedDecision {
  LiveDecision live;
  bool was_connected = true;  // live: else nothing was decided
  bool is_connected = true;   // under the other model
  // The connection's changed decision before has become the same, and none that is surely
  // unchanged lies between the two.
  bool goes_on = false;
};

// From one time to another, the winner at a port is not the recorded one. Empty: nobody.
struct WinnerInterval {
  std::string port;
  Nanoseconds from = 0;
  Nanoseconds to = 0;
  std::string recorded;
  std::string other;
};

struct Comparison {
  // The live ones; and of arrivals that the other model alone connects to an open input port, those
  // that it delivers, or may.
  std::uint64_t decisions = 0;
  std::uint64_t same = 0;
  std::uint64_t uncertain = 0;  // overlapped, behind a gap, or blind
  std::vector<ChangedDecision> changed;
  std::vector<WinnerInterval> intervals;  // by time, then port
};

// `other`: a judge that makes activities last as its model says.
[[nodiscard]] Comparison compare(const Recorded& recorded, Models& models, Judge& other,
                                 const recording::Watch& watch = {});

// Every change of winner in a run, by the recorded models, or by another.
[[nodiscard]] std::vector<WinnerChange> winners_of(const Run& run, Models& models);
[[nodiscard]] std::vector<WinnerChange> winners_of(const Run& run, const Judge& other);

}  // namespace arbiter::evidence
