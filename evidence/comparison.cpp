#include "evidence/comparison.hpp"

#include <algorithm>
#include <map>
#include <tuple>
#include <utility>

#include "evidence/winner_track.hpp"

namespace arbiter::evidence {
namespace {

// What a track of winners is told, in the order of time.
struct Cue {
  Nanoseconds time = 0;
  const std::string* source = nullptr;  // null: a model
  const Step* step = nullptr;
  const ModelChange* model = nullptr;
};

// The first model comes behind the states with which the run begins.
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

WinnerChange::Why why_of(Step::Kind kind) {
  switch (kind) {
    case Step::Kind::arrival:
      return WinnerChange::Why::arrival;
    case Step::Kind::deactivation:
      return WinnerChange::Why::deactivation;
    case Step::Kind::state:
      break;
  }
  return WinnerChange::Why::state;
}

// `set_model(track, model)` puts rules in force; `word_of(source, step)` says how active it is.
template <class SetModel, class WordOf>
std::vector<WinnerChange> follow(const Run& run, const SetModel& set_model, const WordOf& word_of) {
  std::vector<WinnerChange> changes;
  WinnerTrack track([&](WinnerChange&& change) { changes.push_back(std::move(change)); });
  track.start(run.start);
  for (const Cue& cue : cues_of(run)) {
    if (cue.model != nullptr) {
      set_model(track, *cue.model, cue.time);
    } else {
      track.apply(*cue.source, word_of(*cue.source, *cue.step), cue.time, why_of(cue.step->kind));
    }
  }
  track.advance(run.end);
  return changes;
}

// Where two tracks of one run differ.
class Intervals {
 public:
  explicit Intervals(const Run& run) : run_(run) {}

  void take(const WinnerChange& change, bool is_other) {
    Port& port = ports_[change.port];
    end(change.port, port, change.time);
    (is_other ? port.other : port.recorded) = change.winner;
    port.since = change.time;
  }
  std::vector<WinnerInterval> finish() {
    for (auto& [name, port] : ports_) end(name, port, run_.end);
    return std::move(intervals_);
  }

 private:
  struct Port {
    std::string recorded;
    std::string other;
    Nanoseconds since = 0;
  };
  void end(const std::string& name, Port& port, Nanoseconds time) {
    if (port.recorded == port.other || time <= port.since) return;
    intervals_.push_back({name, port.since, time, port.recorded, port.other});
  }

  const Run& run_;
  std::map<std::string, Port> ports_;
  std::vector<WinnerInterval> intervals_;
};

std::vector<WinnerInterval> differing(const Run& run, const std::vector<WinnerChange>& recorded,
                                      const std::vector<WinnerChange>& other) {
  Intervals intervals(run);
  std::size_t i = 0;
  std::size_t k = 0;
  while (i < recorded.size() || k < other.size()) {
    const bool is_other =
        i == recorded.size() || (k < other.size() && other[k].time < recorded[i].time);
    intervals.take(is_other ? other[k++] : recorded[i++], is_other);
  }
  auto all = intervals.finish();
  std::sort(all.begin(), all.end(), [](const WinnerInterval& one, const WinnerInterval& two) {
    return std::tie(one.from, one.port) < std::tie(two.from, two.port);
  });
  return all;
}

void judge(const LiveDecision& live, Judge& other, Comparison& comparison) {
  ++comparison.decisions;
  Judge::Connection connection{};
  const Permitted permitted = other.permitted(*live.run, *live.decision, *live.port, connection);
  if (live.is_blind || !permitted.is_sure()) {
    ++comparison.uncertain;
  } else if (permitted.has(live.won)) {
    ++comparison.same;
  } else {
    comparison.changed.push_back({live, connection == Judge::Connection::there});
  }
}

}  // namespace

std::vector<WinnerChange> winners_of(const Run& run, Models& models) {
  return follow(
      run,
      [&](WinnerTrack& track, const ModelChange& model, Nanoseconds time) {
        const Judge* judge = models.judge(run, model.generation);
        track.set_rules(judge == nullptr ? nullptr : rule_table_of(judge->simulation()),
                        model.generation, time);
      },
      [](const std::string& /*source*/, const Step& step) { return step.word; });
}

std::vector<WinnerChange> winners_of(const Run& run, const Judge& other) {
  bool is_set = false;
  return follow(
      run,
      [&](WinnerTrack& track, const ModelChange& model, Nanoseconds time) {
        if (std::exchange(is_set, true)) return;
        track.set_rules(rule_table_of(other.simulation()), model.generation, time);
      },
      [&](const std::string& source, const Step& step) {
        return other.word_of(source, step, run.start);
      });
}

Comparison compare(const Recorded& recorded, Models& models, Judge& other) {
  Comparison comparison;
  for (const Run& run : recorded.runs) {
    for_each_decision(run, [&](const LiveDecision& live) { judge(live, other, comparison); });
    auto intervals = differing(run, winners_of(run, models), winners_of(run, other));
    std::move(intervals.begin(), intervals.end(), std::back_inserter(comparison.intervals));
  }
  return comparison;
}

}  // namespace arbiter::evidence
