#include "evidence/comparison.hpp"

#include <algorithm>
#include <map>
#include <string_view>
#include <tuple>
#include <utility>

#include "evidence/cues.hpp"
#include "evidence/open_inputs.hpp"
#include "evidence/winner_track.hpp"

namespace arbiter::evidence {
namespace {

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
    if (cue.time >= run.until) break;
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

// Of one run of the recording.
class Decisions {
 public:
  Decisions(const Run& run, Models& models, Judge& other, Comparison& comparison)
      : run_(run),
        models_(models),
        other_(other),
        comparison_(comparison),
        open_(run.port_changes) {}

  void take(const Decision& decision) {
    for_each_outcome(run_, decision, [this](const LiveDecision& live) { take_decided(live); });
    take_newly_connected(decision);
  }

 private:
  // What the other model has made of a connection's decision.
  enum class Before : std::uint8_t { same, won, lost };

  void take_decided(const LiveDecision& live) {
    ++comparison_.decisions;
    Judge::Connection connection{};
    const Permitted permitted = other_.permitted(run_, *live.decision, *live.port, connection);
    if (live.is_blind || !permitted.is_sure()) {
      ++comparison_.uncertain;
      return;
    }
    if (permitted.has(live.won)) {
      ++comparison_.same;
      before(live) = Before::same;
      return;
    }
    change({live, true, connection == Judge::Connection::there});
  }

  // Nothing was decided where the model of then does not connect the two.
  void take_newly_connected(const Decision& decision) {
    const rules::Simulation& simulation = other_.simulation();
    rules::TraceEvent event;
    event.at = decision.arrival().time;
    event.source = decision.context->source;
    const auto live_model = models_.judge(run_, decision.arrival().generation);
    if (live_model == nullptr || !simulation.knows(event.source)) return;
    for (const shm::PortId port : simulation.ports_of(event)) {
      const std::string& name = simulation.port_name(port);
      if (live_model->connects(event.source, name) || !other_.connects(event.source, name) ||
          !is_chosen(run_, name) || !open_.has(event.at, name)) {
        continue;
      }
      const LiveDecision live{&run_, &decision, &name, false, false};
      Judge::Connection connection{};
      const Permitted permitted = other_.permitted(run_, decision, name, connection);
      if (permitted.is_sure() && !permitted.wins) {
        before(live) = Before::same;
        continue;
      }
      ++comparison_.decisions;
      if (permitted.is_sure()) {
        change({live, false, true});
      } else {
        ++comparison_.uncertain;
      }
    }
  }

  void change(ChangedDecision changed) {
    const Before now = changed.live.won ? Before::lost : Before::won;
    changed.goes_on = std::exchange(before(changed.live), now) == now;
    comparison_.changed.push_back(changed);
  }
  Before& before(const LiveDecision& live) {
    return before_[{live.decision->context->source, *live.port}];
  }

  const Run& run_;
  Models& models_;
  Judge& other_;
  Comparison& comparison_;
  OpenInputs open_;
  // By source and port. Contexts outlive this.
  std::map<std::pair<std::string_view, std::string_view>, Before> before_;
};

}  // namespace

std::vector<WinnerChange> winners_of(const Run& run, Models& models) {
  return follow(
      run,
      [&](WinnerTrack& track, const ModelChange& model, Nanoseconds time) {
        const auto judge = models.judge(run, model.generation);
        track.set_rules(judge == nullptr ? nullptr : rule_table_of(judge->simulation(), judge),
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

Comparison compare(const Recorded& recorded, Models& models, Judge& other,
                   const recording::Watch& watch) {
  Comparison comparison;
  for (const Run& run : recorded.runs) {
    Decisions decisions(run, models, other, comparison);
    for_each_arrival(
        run, [&](const Decision& decision) { decisions.take(decision); }, watch);
    auto intervals = differing(run, winners_of(run, models), winners_of(run, other));
    std::move(intervals.begin(), intervals.end(), std::back_inserter(comparison.intervals));
  }
  return comparison;
}

}  // namespace arbiter::evidence
