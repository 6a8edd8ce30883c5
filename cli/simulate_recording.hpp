// arbiter simulate --recording.
#pragma once

#include <string>

#include "cli/recording_part.hpp"
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
  PartOptions part{};
};

// All that is recorded, or the part of it. Says on standard error where the file is not whole.
// Throws McapError, RecordError, CLI::ValidationError.
evidence::Recorded load_for_simulation(const std::string& path, const PartOptions& part);
// The part of it; without options, all. Throws as the above.
evidence::TimeSpan part_of(const std::string& path, const PartOptions& options);
// Without most of what is not about winners.
evidence::Recorded load_winners(const std::string& path);

// Says on standard error what the recorder missed, if it missed anything.
void warn_of_missed(const evidence::Recorded& recorded);

// 0: all is as it was; 1: something differs, or there is no decision to compare.
int simulate_recording(const SimulateRecordingOptions& options);

}  // namespace arbiter::cli
