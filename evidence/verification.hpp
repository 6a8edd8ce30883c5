// Takes each decision of a recording again, by the models that it has, and compares it with the
// live one.
#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <string>

#include "evidence/judge.hpp"
#include "evidence/models.hpp"
#include "evidence/recorded.hpp"

namespace arbiter::evidence {

// Of an arrival at one input port.
struct LiveDecision {
  const Run* run = nullptr;
  const Decision* decision = nullptr;
  const std::string* port = nullptr;
  bool is_blind = false;
  bool won = false;  // accepted, or refused although it was the winner
};

// Whether the recording is to have all that is decided at this input port.
[[nodiscard]] bool is_chosen(const Run& run, const std::string& port);
// Calls `use` for what was decided of an arrival at chosen ports.
void for_each_outcome(const Run& run, const Decision& decision,
                      const std::function<void(const LiveDecision&)>& use);
// Calls `use` for each arrival from the run's start on, by time. `watch` counts arrivals of the
// run.
void for_each_arrival(const Run& run, const std::function<void(const Decision&)>& use,
                      const recording::Watch& watch = {});
// The same for what was decided of it at chosen ports.
void for_each_decision(const Run& run, const std::function<void(const LiveDecision&)>& use,
                       const recording::Watch& watch = {});

// The first that differs.
struct Difference {
  LiveDecision live;
  std::string text;  // what the model says instead, and of which activities
};

struct Verification {
  std::uint64_t equal = 0;
  // The order of what happened beside it is not known, and decides; the live outcome is one of
  // those that are permitted.
  std::uint64_t overlapped = 0;
  std::uint64_t blind = 0;       // live, no decision was taken
  std::uint64_t behind_gap = 0;  // what it depends on is not in the recording
  std::uint64_t without_model = 0;
  std::uint64_t different = 0;
  std::optional<Difference> first{};

  [[nodiscard]] std::uint64_t all() const {
    return equal + overlapped + blind + behind_gap + without_model + different;
  }
};

[[nodiscard]] Verification verify(const Recorded& recorded, Models& models,
                                  const recording::Watch& watch = {});

}  // namespace arbiter::evidence
