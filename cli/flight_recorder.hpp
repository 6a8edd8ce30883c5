// arbiter record --ring, and --dump.
#pragma once

#include <cstddef>
#include <optional>
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
  std::size_t keep = 16;                      // files that it writes of its own accord
  std::optional<std::string> when;            // a statement
  shm::Nanoseconds after = 2'000'000'000;     // of what follows, in a file of its own accord
  shm::Nanoseconds duration = shm::kForever;  // from the first look on
};

// Until SIGINT, SIGTERM or SIGHUP; SIGUSR1 writes a file.
int fly(const FlightOptions& options, const recorder::RecorderOptions& settings,
        const recording::McapOptions& file, const evidence::RecordingInfo& info);
// Asks the one that runs, and waits for so long at most.
int dump(const std::string& prefix, shm::Nanoseconds patience);

}  // namespace arbiter::cli
