// What runs on each host: a component that publishes commands and has a motor, both in one process.
#pragma once

#include <cstdint>
#include <string>

namespace arbiter::failures {

struct ComponentOptions {
  std::string instance;
  unsigned host = 0;
  std::uint32_t life = 0;
  std::uint64_t seed = 0;
  std::int64_t period_ns = 0;
  bool is_rival = false;
};

// Publishes in bursts, now and then deactivates its source, holds, and takes what commands its
// motor, until SIGTERM. SIGUSR1: it publishes without pauses from now on. SIGUSR2: it publishes
// nothing more. Writes to standard error what it must not see, in lines that begin with "FOUND ".
//
// A rival publishes the shared source instead, without pauses, and takes nothing.
int run_component(const ComponentOptions& options);

}  // namespace arbiter::failures
