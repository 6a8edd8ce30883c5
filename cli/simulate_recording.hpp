// arbiter simulate --recording.
#pragma once

#include <string>

#include "rules/model/load.hpp"

namespace arbiter::cli {

struct SimulateRecordingOptions {
  std::string recording;
  rules::ModelFiles other;  // without models: those of the recording
  double effort = 1;
  bool json = false;
};

// 0: all is as it was; 1: something differs, or there is no decision to compare.
int simulate_recording(const SimulateRecordingOptions& options);

}  // namespace arbiter::cli
