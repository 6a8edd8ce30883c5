// What has happened in a run, in the order of time: for those who follow it from event to event.
#pragma once

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

}  // namespace arbiter::evidence
