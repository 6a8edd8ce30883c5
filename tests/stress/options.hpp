// What a run is told to do.
#pragma once

#include <cstdint>
#include <string>

namespace arbiter::stress {

struct Options {
  std::uint64_t seed = 0;
  double seconds = 30;           // at least so long, unless `operations` says otherwise
  std::uint64_t operations = 0;  // at least so many
  std::uint32_t publishers = 0;  // 0: 1 to 8, each round another number
  std::uint32_t receivers = 0;   // 0: 1 to 8
  std::uint64_t kills = 0;       // so many, at random
  std::uint64_t stops = 0;       // SIGSTOP and SIGCONT, so many
  double stop_seconds = 0;       // each at least so long
  std::uint64_t daemon_kills = 0;
  bool keep_daemon_dead = false;  // no new one is started after the kill
  bool swaps = true;
  bool threads = false;  // one process: for sanitizers
};

// Exits the program for --help and for wrong use.
Options parse(int argc, char** argv);

}  // namespace arbiter::stress
