#include "bench/measures/contest_pair.hpp"

#include <unistd.h>

#include <algorithm>

#include "bench/harness/cpu.hpp"
#include "bench/harness/shared.hpp"
#include "bench/peers/spin.hpp"

namespace arbiter::bench {
namespace {

std::shared_ptr<Stage> shared_stage() {
  const auto shared = std::make_shared<Shared<Stage>>();
  return {shared, &**shared};
}

void play_sources(Conversation& with, ContestSession& session, Stage& stage, const Roles& roles) {
  const auto sources = session.open_sources();
  pin(0);
  with.say(1);
  std::uint64_t trial = 0;
  for (std::uint64_t count = 0; with.hear_or_end(count);) {
    for (; count != 0; --count) {
      roles.sources(*sources, stage, ++trial);
      spin_until([&] { return stage.finished.load(std::memory_order_acquire) == trial; });
    }
  }
}

void play_destination(Conversation& with, ContestSession& session, Stage& stage,
                      const Roles& roles) {
  const auto destination = session.open_destination();
  pin(1);
  with.say(1);
  std::uint64_t trial = 0;
  for (std::uint64_t count = 0; with.hear_or_end(count);) {
    with.say(1);
    Words found;
    for (; count != 0; --count) {
      const Words more = roles.destination(*destination, stage, ++trial);
      found.insert(found.end(), more.begin(), more.end());
      stage.finished.store(trial, std::memory_order_release);
    }
    with.say(found);
  }
}

}  // namespace

ContestPair::ContestPair(const ContestSystem& system, const Contest& contest, const Roles& roles)
    : session_(system.prepare(contest)),
      stage_(shared_stage()),
      destination_(
          system.name + ", destination",
          [this, roles](Conversation& with) { play_destination(with, *session_, *stage_, roles); }),
      sources_(system.name + ", sources", [this, roles](Conversation& with) {
        play_sources(with, *session_, *stage_, roles);
      }) {
  destination_.hear();
  sources_.hear();
}

Words ContestPair::trials(std::uint64_t count) {
  const std::int64_t before = now_ns();
  destination_.say(count);
  destination_.hear();
  sources_.say(count);
  Words found = destination_.hear_words();
  trial_ns_ = static_cast<double>(now_ns() - before) / static_cast<double>(count);
  return found;
}

Words ContestPair::run(double seconds) {
  constexpr std::uint64_t kFirst = 3;
  if (trial_ns_ == 0) static_cast<void>(trials(kFirst));  // how long it takes, and a warm-up
  return trials(std::max(kFirst, static_cast<std::uint64_t>(seconds * 1e9 / trial_ns_)));
}

Contest contest(std::int64_t timeout_ns, bool falls_silent) {
  static int contests = 0;
  Contest result;
  result.timeout_ns = timeout_ns;
  result.falls_silent = falls_silent;
  result.unique =
      "arbiter-bench-" + std::to_string(::getpid()) + "-contest-" + std::to_string(++contests);
  return result;
}

}  // namespace arbiter::bench
