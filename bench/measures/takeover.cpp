// An override comes while the one that it overrides publishes as fast as it can: for how long is
// the old winner still obeyed?
#include <algorithm>
#include <memory>
#include <random>

#include "bench/harness/cpu.hpp"
#include "bench/measures/contest_pair.hpp"
#include "bench/measures/measures.hpp"
#include "bench/peers/spin.hpp"

namespace arbiter::bench {
namespace {

// How long the old winner goes on after the override has been seen: what has not come out by then
// was dropped.
constexpr std::int64_t kAftermathNs = 200'000;

void override_old(Sources& sources, Stage& stage, std::uint64_t trial) {
  static std::minstd_rand random(1);
  // Until the old winner commands, and for a while that the destination cannot expect.
  std::int64_t until = 0;
  spin_until([&] {
    sources.publish(Party::kOld, trial);
    if (until == 0 && stage.old_seen.load(std::memory_order_acquire) == trial) {
      until = now_ns() + std::uniform_int_distribution<std::int64_t>(10'000, 60'000)(random);
    }
    return until != 0 && now_ns() > until;
  });

  stage.override_began.store(now_ns(), std::memory_order_relaxed);
  sources.publish(Party::kOverride, trial);
  stage.override_returned.store(now_ns(), std::memory_order_relaxed);

  std::int64_t end = 0;
  spin_until([&] {
    sources.publish(Party::kOld, trial);
    if (end == 0 && stage.override_seen.load(std::memory_order_acquire) == trial) {
      end = now_ns() + kAftermathNs;
    }
    return end != 0 && now_ns() > end;
  });
  sources.release();
  stage.ended.store(trial, std::memory_order_release);
}

struct Take {
  std::int64_t began = 0;
  std::int64_t ended = 0;
};

// The last samples of the old winner.
class OldTakes {
 public:
  void clear() { count_ = 0; }
  void add(const Take& take) { takes_[count_++ % takes_.size()] = take; }

  template <class Use>
  void for_each(Use use) const {
    const std::size_t first = count_ > takes_.size() ? count_ - takes_.size() : 0;
    for (std::size_t i = first; i < count_; ++i) use(takes_[i % takes_.size()]);
  }

 private:
  std::vector<Take> takes_ = std::vector<Take>(std::size_t{1} << 16);
  std::size_t count_ = 0;
};

// Three words: nanoseconds from the override's publish() to the old winner's last sample and to the
// override's first one, and how many of the old winner's were taken by takes that began after that
// publish() had returned. `work_ns` is what the destination does with each sample.
Words watch(Destination& destination, Stage& stage, std::uint64_t trial, std::int64_t work_ns) {
  static OldTakes old_takes;
  old_takes.clear();
  std::int64_t override_taken = 0;
  std::int64_t before = now_ns();
  spin_until([&] {
    const Taken taken = destination.take();
    const std::int64_t after = now_ns();
    const bool is_sample = taken.kind == Taken::Kind::kSample;
    if (is_sample && taken.number == trial) {
      if (taken.party == Party::kOld) {
        old_takes.add({before, after});
        stage.old_seen.store(trial, std::memory_order_release);
      } else if (override_taken == 0) {
        override_taken = after;
        stage.override_seen.store(trial, std::memory_order_release);
      }
    }
    before = after;
    while (is_sample && work_ns != 0 && before < after + work_ns) before = now_ns();
    return stage.ended.load(std::memory_order_acquire) == trial;
  });

  const std::int64_t began = stage.override_began.load(std::memory_order_relaxed);
  const std::int64_t returned = stage.override_returned.load(std::memory_order_relaxed);
  std::int64_t last = began;
  std::uint64_t past_override = 0;
  old_takes.for_each([&](const Take& take) {
    last = std::max(last, take.ended);
    if (take.began > returned) ++past_override;
  });
  return {static_cast<std::uint64_t>(last - began),
          static_cast<std::uint64_t>(override_taken - began), past_override};
}

// Of one system, over all its rounds but the first, which is a warm-up.
struct Found {
  Histogram old_last;
  Histogram override_first;
  std::uint64_t takeovers = 0;
  std::uint64_t past_override = 0;
  bool is_warm = false;

  Histogram add(const Words& words) {
    Histogram round;
    for (std::size_t i = 0; i + 2 < words.size(); i += 3) {
      round.add(static_cast<double>(words[i]));
      if (!is_warm) continue;
      ++takeovers;
      old_last.add(static_cast<double>(words[i]));
      override_first.add(static_cast<double>(words[i + 1]));
      past_override += words[i + 2];
    }
    is_warm = true;
    return round;
  }
};

// Three cases, of the same takeovers.
void add_cases(Measure& measure, const std::string& circumstances, std::int64_t work_ns,
               const Budget& budget) {
  const Roles roles{override_old,
                    [work_ns](Destination& destination, Stage& stage, std::uint64_t trial) {
                      return watch(destination, stage, trial, work_ns);
                    }};
  std::vector<Contender> contenders;
  std::vector<std::shared_ptr<Found>> found;
  std::vector<Result> absent_ones;
  for (const ContestSystem& system : contest_systems()) {
    try {
      auto pair = std::make_shared<ContestPair>(system, contest(500'000'000, false), roles);
      auto kept = std::make_shared<Found>();
      contenders.push_back({system.name, system.role, [pair, kept](double seconds) {
                              return kept->add(pair->run(seconds));
                            }});
      found.push_back(std::move(kept));
    } catch (const std::exception& error) {
      absent_ones.push_back(absent(system.name, system.role, error.what()));
    }
  }
  const std::vector<Result> results = run_rounds(std::move(contenders), budget);

  Case old_last{"the old winner's last sample" + circumstances};
  Case override_first{"the override's sample" + circumstances};
  Case past_override{"samples past the override" + circumstances};
  for (std::size_t i = 0; i < results.size(); ++i) {
    Result result = results[i];
    result.ns = found[i]->old_last;
    old_last.results.push_back(result);
    result.ns = found[i]->override_first;
    override_first.results.push_back(result);
    result.ns = {};
    if (found[i]->takeovers != 0) {
      result.value =
          static_cast<double>(found[i]->past_override) / static_cast<double>(found[i]->takeovers);
    }
    past_override.results.push_back(result);
  }
  for (Case* each : {&old_last, &override_first, &past_override}) {
    each->results.insert(each->results.end(), absent_ones.begin(), absent_ones.end());
    measure.cases.push_back(std::move(*each));
  }
}

}  // namespace

Measure measure_takeover(const Effort& effort) {
  Measure measure{
      "takeover", "Takeover",
      "A source publishes as fast as it can; then another, which overrides it, publishes once. "
      "From "
      "the beginning of the override's publish(): to the last sample of the old winner that the "
      "spinning destination takes, 0 where none comes any more, and to the override's sample. And "
      "how many samples of the old winner come, for each takeover, from takes that begin after the "
      "override's publish() has returned. Where the destination works on each sample, a backlog of "
      "the old winner's waits when the override comes.",
      "samples"};
  add_cases(measure, "", 0, effort.budget());
  add_cases(measure, ", 10 us of work on each", 10'000, effort.budget());
  return measure;
}

}  // namespace arbiter::bench
