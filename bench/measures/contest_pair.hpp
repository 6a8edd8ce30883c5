// The two workers of a contest, and what they tell each other while it runs.
#pragma once

#include <atomic>
#include <functional>
#include <memory>

#include "bench/harness/worker.hpp"
#include "bench/peers/contest.hpp"
#include "shm/limits.hpp"

namespace arbiter::bench {

// Shared by the workers. Trials have numbers, from 1; a word says which trial has come so far. They
// are written seldom, so looking at them costs the one who is measured next to nothing.
struct Stage {
  alignas(shm::kCacheLine) std::atomic<std::int64_t> override_began{0};
  std::atomic<std::int64_t> override_returned{0};
  std::atomic<std::uint64_t> ended{0};  // by the sources

  alignas(shm::kCacheLine) std::atomic<std::uint64_t> old_seen{0};
  std::atomic<std::uint64_t> override_seen{0};
  std::atomic<std::uint64_t> finished{0};  // by the destination
};

using Words = std::vector<std::uint64_t>;

// What either worker does in a trial. What the destination finds out is told as words.
struct Roles {
  std::function<void(Sources&, Stage&, std::uint64_t trial)> sources;
  std::function<Words(Destination&, Stage&, std::uint64_t trial)> destination;
};

// Trials of one system.
class ContestPair {
 public:
  ContestPair(const ContestSystem& system, const Contest& contest, const Roles& roles);

  // As many trials as take about so long: what the destination has found out, one after another.
  Words run(double seconds);

 private:
  [[nodiscard]] Words trials(std::uint64_t count);

  std::unique_ptr<ContestSession> session_;
  std::shared_ptr<Stage> stage_;
  Worker destination_;
  Worker sources_;
  double trial_ns_ = 0;
};

// A contest with a name of its own.
Contest contest(std::int64_t timeout_ns, bool falls_silent);

}  // namespace arbiter::bench
