#include "evidence/recorded.hpp"

#include <algorithm>
#include <cstdint>
#include <string>
#include <utility>

#include "rules/text/names.hpp"

namespace arbiter::evidence {
namespace {

// A decision rests on what sources did until it was seen, and what they did is seen so long after
// it at most. What is seen later is taken for unknown.
constexpr Nanoseconds kSeenWithin = 10'000'000'000;

Nanoseconds later(Nanoseconds time) {
  return time < shm::kForever - kSeenWithin ? time + kSeenWithin : shm::kForever;
}

class Loader {
 public:
  explicit Loader(const TimeSpan& part) : part_(part), known_until_(later(part.to)) {}

  // What is read for it.
  [[nodiscard]] TimeSpan events() const {
    return {std::max(part_.from - kSeenWithin, Nanoseconds{0}), known_until_};
  }

  void take(Record&& record) {
    if (const auto* start = std::get_if<Start>(&record)) {
      if (start->time <= part_.from) runs_.clear();
      runs_.emplace_back();
      runs_.back().start = runs_.back().end = start->time;
      runs_.back().ports = start->ports;
      return;
    }
    if (runs_.empty()) throw RecordError("it does not begin with arbiter/start");
    std::visit([this](auto&& each) { add(std::forward<decltype(each)>(each)); }, std::move(record));
  }

  // `until`: when recording ended, if that is known.
  std::vector<Run> finish(Nanoseconds until) {
    if (!runs_.empty()) run().end = std::max(run().end, until);
    for (std::size_t i = 1; i < runs_.size(); ++i) leave_out_strangers(runs_[i - 1], runs_[i]);
    const auto by_time = [](const Decision& one, const Decision& other) {
      return one.arrival().time < other.arrival().time;
    };
    for (Run& run : runs_) {
      auto& all = run.decisions;
      const bool is_sorted = std::is_sorted(all.begin(), all.end(), by_time);
      if (!is_sorted) std::stable_sort(all.begin(), all.end(), by_time);  // takes memory
      cut(run);
    }
    std::erase_if(runs_, [&](const Run& run) { return run.start >= part_.to || is_before(run); });
    return std::move(runs_);
  }

 private:
  Run& run() { return runs_.back(); }

  [[nodiscard]] bool is_before(const Run& run) const { return run.end < part_.from; }
  // To the part. What sources did before it is a state of each as it begins.
  void cut(Run& run) const {
    run.end = std::min(run.end, part_.to);
    run.until = part_.to;
    for (auto& [source, history] : run.sources) {
      history.unknown_from = std::min(history.unknown_from, known_until_);
    }
    if (run.start >= part_.from || is_before(run)) return;
    run.start = part_.from;
    for (auto& [source, history] : run.sources) {
      if (history.steps.empty() || history.steps.front().seen >= part_.from) continue;
      Step& first = history.steps.front();
      first.kind = Step::Kind::state;
      first.lost = 0;
    }
  }

  // Until the recorder notices that a daemon has come with memory of its own, taps tell of that
  // memory already. Of what was done there, the run before knows nothing. Without a model in force
  // it is not known since when the memory is there; nor is anything decided then.
  static void leave_out_strangers(Run& run, const Run& next) {
    if (next.models.empty()) return;
    const ModelChange& first = next.models.begin()->second;
    if (first.generation == 0 || first.time == 0) return;
    for (auto& [source, history] : run.sources) {
      const auto is_strange = [&](const Step& step) { return step.time >= first.time; };
      auto& steps = history.steps;
      steps.erase(std::find_if(steps.begin(), steps.end(), is_strange), steps.end());
    }
    run.left_out += std::erase_if(
        run.decisions, [](const Decision& each) { return each.step >= each.source->steps.size(); });
  }

  // Behind the first step beyond it, decisions of the part rest on none.
  [[nodiscard]] bool is_past(const SourceHistory& history) const {
    return !history.steps.empty() && history.steps.back().time >= known_until_;
  }

  // Each takes effect after the one before. Of those that were over before the part began, nothing
  // rests on any but the last. Null: it lies beyond what decisions of the part rest on.
  SourceHistory* add_step(const SourceContext& context, Step step) {
    SourceHistory& history = run().sources[context.source];
    if (!history.steps.empty()) {
      step.seen = std::max(step.seen, history.steps.back().seen);
    }
    run().end = std::max(run().end, step.seen);
    if (is_past(history)) return nullptr;
    if (step.seen < part_.from) history.steps.clear();
    history.steps.push_back(step);
    return &history;
  }

  void add(Arrival&& each) {
    SourceHistory* const history =
        add_step(*each.context,
                 {each.time, each.seen, each.word, Step::Kind::arrival, false, 0, each.generation});
    if (history == nullptr) return;
    history->word = each.word;
    if (!part_.has(each.time)) return;
    const auto step = static_cast<std::uint32_t>(history->steps.size() - 1);
    run().decisions.push_back(
        {history, step, each.is_sample, std::move(each.context), each.sequence, each.masks});
  }

  void add(Deactivation&& each) {
    SourceHistory* const history =
        add_step(*each.context, {each.time, each.seen, shm::deactivation(each.time),
                                 Step::Kind::deactivation, false, 0, each.generation});
    if (history != nullptr) history->word = shm::deactivated(history->word, each.time);
  }

  // Where a state says what was known already, nothing has happened in between: a value stands for
  // one write (shm/activity.hpp).
  void add(SourceState&& each) {
    SourceHistory& history = run().sources[each.context->source];
    if (part_.has(each.seen)) run().lost += each.lost;
    run().end = std::max(run().end, each.seen);
    if (is_past(history)) return;
    const bool is_known = !history.steps.empty() && history.word == each.word;
    // It is tapped now; the step below stands behind the gap.
    if (each.why != SourceState::Why::page) history.unknown_from = shm::kForever;
    if (is_known && each.lost == 0) return;
    const auto lost = static_cast<std::uint32_t>(std::min<std::uint64_t>(each.lost, UINT32_MAX));
    Step step{each.time, each.seen, each.word, Step::Kind::state, false, lost, each.generation};
    if (each.why == SourceState::Why::page) {
      // Of one that cannot be tapped, pages tell some of its steps.
      step.is_behind_gap = history.unknown_from != shm::kForever;
      // One write at most, and no publisher there to tell of it.
      const bool tells_time = shm::is_deactivation(each.word) || !shm::is_finite(each.word);
      step.time = tells_time              ? shm::time_of(each.word, shm::kForever)
                  : history.steps.empty() ? 0
                                          : history.steps.back().time;
    } else {
      step.is_behind_gap = true;
      // A publisher that was killed may have deactivated it after what it told last.
      if (shm::is_deactivation(each.word)) {
        const Nanoseconds deactivated = shm::time_of(each.word, shm::kForever);
        step.time = std::clamp(deactivated, step.time, each.seen);
      }
    }
    if (add_step(*each.context, step) != nullptr) history.word = each.word;
  }

  void add(ModelChange&& each) {
    run().end = std::max(run().end, each.time);
    run().models.insert_or_assign(each.generation, std::move(each));
  }
  void add(WinnerChange&& each) {
    run().end = std::max(run().end, each.time);
    run().winners.push_back(std::move(each));
  }
  void add(Start&& /*taken*/) {}
  void add(DestinationsChange&& /*contexts have it*/) {}
  void add(PortChange&& each) {
    (each.is_input ? run().port_changes : run().output_changes[each.port])
        .push_back(std::move(each));
  }
  // Of what was overtaken a state says where it goes on.
  void add(Missed&& each) {
    const bool is_of_part = each.to >= part_.from && each.from < part_.to;
    if (is_of_part) run().lost_samples += each.samples;
    if (is_of_part && each.events != 0) {
      run().gaps.push_back(each);
      Nanoseconds& since = run().gaps.back().from;
      if (since == 0) since = run().start;
    }
    if (each.why != Missed::Why::refused) return;
    Nanoseconds& from = run().sources[each.source].unknown_from;
    from = std::min(from, each.from);
  }

  const TimeSpan part_;
  const Nanoseconds known_until_;
  std::vector<Run> runs_;
};

}  // namespace

std::string missed_text(std::uint64_t events, std::uint64_t samples) {
  std::string text = events == 0 ? "" : rules::counted(events, "event");
  if (samples == 0) return text;
  return text + (text.empty() ? "" : " and ") + "the payloads of " +
         rules::counted(samples, "sample");
}

std::string missed_text(const Recorded& recorded) {
  std::uint64_t events = 0;
  std::uint64_t samples = 0;
  for (const Run& run : recorded.runs) {
    events += run.lost;
    samples += run.lost_samples;
  }
  return missed_text(events, samples);
}

Recorded load_recording(const std::string& path, const recording::Watch& watch, Wanted wanted,
                        const TimeSpan& part) {
  Recorded recorded;
  Loader loader(part);
  const auto use = [&](Record&& record) { loader.take(std::move(record)); };
  const TimeSpan events = wanted == Wanted::winners ? TimeSpan{0, 0} : loader.events();
  recorded.about = read_recording(path, Payloads::pass_over, use, watch, events);
  recorded.runs = loader.finish(recorded.about.recorded_until);
  return recorded;
}

}  // namespace arbiter::evidence
