#include "evidence/export.hpp"

#include <algorithm>
#include <map>
#include <string>
#include <tuple>
#include <vector>

#include "evidence/comparison.hpp"
#include "evidence/verification.hpp"
#include "rules/explain/simulation.hpp"
#include "rules/text/csv.hpp"
#include "shm/activity.hpp"

namespace arbiter::evidence {
namespace {

struct TraceRow {
  Nanoseconds time = 0;
  const std::string* source = nullptr;
  bool is_deactivation = false;
};

const Judge* first_judge(const Run& run, Models& models) {
  return run.models.empty() ? nullptr : models.judge(run, run.models.begin()->first);
}

// When the source arrived that is active as the run begins.
Nanoseconds arrival_before(const std::string& source, const Step& step, const Run& run,
                           Models& models) {
  if (!shm::is_finite(step.word)) return step.word & ~shm::kForeverFlag;
  const Judge* judge = first_judge(run, models);
  const Nanoseconds time =
      judge == nullptr ? run.start : shm::arrival_of(step.word, judge->timeout(source));
  return time >= 0 && time <= run.start ? time : run.start;
}

std::vector<TraceRow> trace_of(const Run& run, Models& models) {
  std::vector<TraceRow> rows;
  for (const auto& [source, history] : run.sources) {
    for (const Step& step : history.steps) {
      const bool is_initial = step.kind == Step::Kind::state && step.seen <= run.start;
      if (is_initial && shm::is_active(step.word, run.start)) {
        rows.push_back({arrival_before(source, step, run, models), &source, false});
      } else if (step.kind == Step::Kind::arrival) {
        rows.push_back({step.time, &source, false});
      } else if (step.kind == Step::Kind::deactivation ||
                 (!is_initial && shm::is_deactivation(step.word))) {
        rows.push_back({step.time, &source, true});
      }
    }
  }
  std::stable_sort(rows.begin(), rows.end(), [](const TraceRow& one, const TraceRow& other) {
    return one.time < other.time;
  });
  return rows;
}

// Who wins at a port, at times that do not fall.
class WinnersByTime {
 public:
  explicit WinnersByTime(std::vector<WinnerChange> changes) : changes_(std::move(changes)) {}

  const std::string& at(Nanoseconds time, const std::string& port) {
    while (next_ < changes_.size() && changes_[next_].time <= time) {
      winners_[changes_[next_].port] = changes_[next_].winner;
      ++next_;
    }
    return winners_[port];
  }

 private:
  const std::vector<WinnerChange> changes_;
  std::size_t next_ = 0;
  std::map<std::string, std::string> winners_;
};

}  // namespace

void write_trace(const Recorded& recorded, Models& models, std::ostream& out) {
  out << "t_ns,source,event\n";
  for (const Run& run : recorded.runs) {
    for (const TraceRow& row : trace_of(run, models)) {
      out << row.time << ',' << rules::to_csv(*row.source) << ','
          << (row.is_deactivation ? "deactivate" : "arrive") << '\n';
    }
  }
}

void write_decisions(const Recorded& recorded, Models& models, std::ostream& out) {
  rules::write_outcome_header(out);
  for (const Run& run : recorded.runs) {
    WinnersByTime winners(winners_of(run, models));
    for_each_decision(run, [&](const LiveDecision& live) {
      const Step& arrival = live.decision->arrival();
      rules::TraceEvent event;
      event.at = arrival.time;
      event.source = live.decision->context->source;
      const std::string& by_time = winners.at(arrival.time, *live.port);
      rules::write_outcome(out, {event, *live.port, {live.won, live.won ? event.source : by_time}});
    });
  }
}

}  // namespace arbiter::evidence
