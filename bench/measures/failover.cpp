// The commander falls silent: when does the next one command, and when does the destination learn
// that there is none?
#include <memory>

#include "bench/harness/cpu.hpp"
#include "bench/measures/contest_pair.hpp"
#include "bench/measures/measures.hpp"
#include "bench/peers/spin.hpp"

namespace arbiter::bench {
namespace {

constexpr std::int64_t kTimeoutNs = 20'000'000;
constexpr std::int64_t kPeriodNs = 50'000;  // of the next one's samples

void command_once(Sources& sources, Stage& stage, std::uint64_t trial) {
  stage.override_began.store(now_ns(), std::memory_order_release);
  sources.publish(Party::kOverride, trial);
}

void fall_silent(Sources& sources, Stage& stage, std::uint64_t trial) {
  command_once(sources, stage, trial);
  spin_until([&] { return stage.finished.load(std::memory_order_acquire) == trial; });
}

void fall_silent_beside_another(Sources& sources, Stage& stage, std::uint64_t trial) {
  command_once(sources, stage, trial);
  std::int64_t next = now_ns();
  spin_until([&] {
    if (now_ns() >= next) {
      sources.publish(Party::kOld, trial);
      next += kPeriodNs;
    }
    return stage.finished.load(std::memory_order_acquire) == trial;
  });
}

// Blocks until `is_it` has come out.
template <class IsIt>
void await(Destination& destination, IsIt is_it) {
  const std::int64_t deadline = now_ns() + kPatienceNs;
  while (!is_it(destination.wait())) {
    if (now_ns() > deadline) throw BenchError("no sample has come for ten seconds");
  }
}

// One word: nanoseconds from the expiry of the commander's activity to what `is_it`.
template <class IsIt>
Words watch_for(Destination& destination, const Stage& stage, std::uint64_t trial, IsIt is_it) {
  await(destination, [&](const Taken& taken) {
    return taken.kind == Taken::Kind::kSample && taken.party == Party::kOverride &&
           taken.number == trial;
  });
  await(destination, is_it);
  const std::int64_t after = now_ns();
  const std::int64_t expiry = stage.override_began.load(std::memory_order_acquire) + kTimeoutNs;
  if (after < expiry) throw BenchError("the commander's time was not yet over");
  return {static_cast<std::uint64_t>(after - expiry)};
}

Words watch_for_next(Destination& destination, Stage& stage, std::uint64_t trial) {
  return watch_for(destination, stage, trial, [&](const Taken& taken) {
    return taken.kind == Taken::Kind::kSample && taken.party == Party::kOld &&
           taken.number == trial;
  });
}

Words watch_for_idle(Destination& destination, Stage& stage, std::uint64_t trial) {
  return watch_for(destination, stage, trial,
                   [](const Taken& taken) { return taken.kind == Taken::Kind::kIdle; });
}

Case run_case(const std::string& name, const Roles& roles, const Budget& budget) {
  Case one{name};
  std::vector<Contender> contenders;
  std::vector<Result> absent_ones;
  std::vector<ContestSystem> systems = contest_systems();
  systems.push_back({"pipe and timer", Role::kFloor, pipe_and_timer});
  for (const ContestSystem& system : systems) {
    try {
      auto pair = std::make_shared<ContestPair>(system, contest(kTimeoutNs, true), roles);
      contenders.push_back({system.name, system.role, [pair](double seconds) {
                              Histogram seen;
                              for (const std::uint64_t ns : pair->run(seconds)) {
                                seen.add(static_cast<double>(ns));
                              }
                              return seen;
                            }});
    } catch (const std::exception& error) {
      absent_ones.push_back(absent(system.name, system.role, error.what()));
    }
  }
  one.results = run_rounds(std::move(contenders), budget);
  one.results.insert(one.results.end(), absent_ones.begin(), absent_ones.end());
  return one;
}

}  // namespace

Measure measure_failover(const Effort& effort) {
  Measure measure{
      "failover", "Failover",
      "The commander falls silent, with a timeout of 20 ms (for Cyclone DDS: the lease of its "
      "liveliness, by topic). From the expiry, which is 20 ms after the beginning of its last "
      "publish(), to when the blocking destination has the next one's sample, which comes every 50 "
      "us; and, where there is no next one, to when it is told that nobody commands. The floor is "
      "a source "
      "that knows when it may write to a pipe, and a destination that sets itself a timer: after "
      "so "
      "long a sleep a core wakes slowly."};
  // A trial takes 20 ms whatever is measured.
  const Budget budget = effort.quick ? Budget{4, 0.25} : Budget{10, 0.5};
  measure.cases.push_back(
      run_case("the next one's sample", {fall_silent_beside_another, watch_for_next}, budget));
  measure.cases.push_back(
      run_case("told that nobody commands", {fall_silent, watch_for_idle}, budget));
  return measure;
}

}  // namespace arbiter::bench
