// Spinning until a sample is there.
#pragma once

#include "bench/harness/cpu.hpp"
#include "bench/harness/worker.hpp"

namespace arbiter::bench {

inline constexpr std::int64_t kPatienceNs = 10'000'000'000;

// Calls `attempt` until it returns true. Throws BenchError after ten seconds.
template <class Attempt>
void spin_until(Attempt attempt) {
  constexpr int kBetweenLooksAtTheClock = 1 << 16;
  std::int64_t deadline = 0;
  for (;;) {
    for (int i = 0; i < kBetweenLooksAtTheClock; ++i) {
      if (attempt()) return;
    }
    const std::int64_t now = now_ns();
    if (deadline == 0) deadline = now + kPatienceNs;
    if (now > deadline) throw BenchError("no sample has come for ten seconds");
  }
}

}  // namespace arbiter::bench
