// arbiter simulate --recording.
#pragma once

#include <string>

#include "evidence/recorded.hpp"
#include "rules/model/load.hpp"

namespace arbiter::cli {

struct SimulateRecordingOptions {
  std::string recording;
  rules::ModelFiles other;  // without models: those of the recording
  double effort = 1;
  bool each = false;  // with another model: a line for each changed decision
  bool json = false;
  std::string at{};  // with --why: only at that time of day; empty: throughout
};

// Says on standard error where it is not whole. Throws McapError, RecordError.
evidence::Recorded load_for_simulation(const std::string& path,
                                       evidence::Wanted wanted = evidence::Wanted::all);

// Says on standard error what the recorder missed, if it missed anything.
void warn_of_missed(const evidence::Recorded& recorded);

// 0: all is as it was; 1: something differs, or there is no decision to compare.
int simulate_recording(const SimulateRecordingOptions& options);

}  // namespace arbiter::cli
