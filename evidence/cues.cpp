#include "evidence/cues.hpp"

#include <algorithm>

namespace arbiter::evidence {

std::vector<Cue> cues_of(const Run& run) {
  std::vector<Cue> cues;
  for (const auto& [source, history] : run.sources) {
    Nanoseconds last = run.start;
    for (const Step& step : history.steps) {
      last = std::max(last, step.time);
      cues.push_back({step.seen <= run.start ? run.start : last, &source, &step, nullptr});
    }
  }
  for (const auto& [generation, model] : run.models) {
    cues.push_back({std::max(run.start, model.time), nullptr, nullptr, &model});
  }
  std::stable_sort(cues.begin(), cues.end(),
                   [](const Cue& one, const Cue& other) { return one.time < other.time; });
  return cues;
}

}  // namespace arbiter::evidence
