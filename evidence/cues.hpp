// What has happened in a run, in the order of time: for those who follow it from event to event.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "evidence/recorded.hpp"

namespace arbiter::evidence {

// A step of a source, or a model that comes into force. Points into the run.
struct Cue {
  Nanoseconds time = 0;
  const std::string* source = nullptr;  // null: a model
  const Step* step = nullptr;
  const ModelChange* model = nullptr;
};

// Times do not fall. The first model comes behind the states with which the run begins.
[[nodiscard]] std::vector<Cue> cues_of(const Run& run);

// What a source did between two of its steps is not in the recording. Points into the run.
struct Gap {
  const std::string* source = nullptr;
  Nanoseconds from = 0;  // the last time at which its activity is known, until it ends by itself
  Nanoseconds to = 0;    // when it is known again
  std::uint64_t events = 0;

  [[nodiscard]] bool has(Nanoseconds time) const { return from < time && time <= to; }
};

// By when they begin. Times are those of the cues.
[[nodiscard]] std::vector<Gap> gaps_of(const Run& run);

}  // namespace arbiter::evidence
