#include "bench/harness/rounds.hpp"

#include <exception>
#include <utility>

#include "bench/harness/interruption.hpp"

namespace arbiter::bench {
namespace {

std::function<void(const Round&)>& watcher() {
  static std::function<void(const Round&)> watch;
  return watch;
}

}  // namespace

void watch_rounds(std::function<void(const Round&)> watch) { watcher() = std::move(watch); }

std::vector<Result> run_rounds(std::vector<Contender> contenders, const Budget& budget) {
  std::vector<Result> results;
  for (const Contender& each : contenders) results.push_back({each.system, each.role, {}, {}, {}});
  for (int round = 0; round <= budget.rounds; ++round) {
    for (std::size_t i = 0; i < contenders.size(); ++i) {
      // Each round begins with another, so that none always follows the same.
      const std::size_t index = (i + static_cast<std::size_t>(round)) % contenders.size();
      if (!contenders[index].round) continue;
      throw_if_interrupted();
      if (watcher()) watcher()({round, budget.rounds, contenders[index].system});
      const bool warms_up = round == 0;
      try {
        const Histogram seen =
            contenders[index].round(warms_up ? budget.seconds_each / 2 : budget.seconds_each);
        if (!warms_up) results[index].ns.add(seen);
      } catch (const std::exception& error) {
        results[index].note = error.what();
        contenders[index].round = nullptr;
      }
    }
  }
  return results;
}

Result absent(const std::string& system, Role role, const std::string& why) {
  return {system, role, {}, {}, why};
}

}  // namespace arbiter::bench
