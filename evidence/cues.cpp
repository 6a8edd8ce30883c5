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
  const ModelChange* first = nullptr;  // in force as the run starts
  for (const auto& [generation, model] : run.models) {
    if (model.time <= run.start) {
      first = &model;
    } else {
      cues.push_back({model.time, nullptr, nullptr, &model});
    }
  }
  if (first != nullptr) cues.push_back({run.start, nullptr, nullptr, first});
  std::stable_sort(cues.begin(), cues.end(),
                   [](const Cue& one, const Cue& other) { return one.time < other.time; });
  return cues;
}

std::vector<Gap> gaps_of(const Run& run) {
  std::vector<Gap> gaps;
  for (const auto& [source, history] : run.sources) {
    Nanoseconds last = run.start;
    for (const Step& step : history.steps) {
      const Nanoseconds before = last;
      last = std::max(last, step.time);
      if (step.lost != 0) gaps.push_back({&source, before, last, step.lost});
    }
  }
  std::stable_sort(gaps.begin(), gaps.end(),
                   [](const Gap& one, const Gap& other) { return one.from < other.from; });
  return gaps;
}

}  // namespace arbiter::evidence
