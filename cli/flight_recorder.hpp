// arbiter record --ring, and --dump.
#pragma once

#include <cstddef>
#include <string>

#include "evidence/record_writer.hpp"
#include "recorder/options.hpp"
#include "recording/mcap.hpp"
#include "shm/activity.hpp"

namespace arbiter::cli {

struct FlightOptions {
  shm::Nanoseconds span = 0;  // 0: no flight recorder
  std::size_t memory = std::size_t{64} << 20;
  std::string prefix;
  std::string when;  // a statement; empty: none
  shm::Nanoseconds end = shm::kForever;
};

// Until SIGINT or SIGTERM; SIGUSR1 writes a file.
int fly(const FlightOptions& options, const recorder::RecorderOptions& settings,
        const recording::McapOptions& file, const evidence::RecordingInfo& info);
// Asks the one that runs.
int dump(const std::string& prefix);

}  // namespace arbiter::cli
