#include "evidence/export.hpp"

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "evidence/comparison.hpp"
#include "evidence/open_inputs.hpp"
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

// Whose T it was made active for, as far as that is known.
std::shared_ptr<const Judge> judge_before(const Run& run, const Step& step, Models& models) {
  if (const auto judge = models.judge(run, step.generation)) return judge;
  return run.models.empty() ? nullptr : models.judge(run, run.models.begin()->first);
}

// When the source arrived that is active as the run begins.
Nanoseconds arrival_before(const std::string& source, const Step& step, const Run& run,
                           Models& models) {
  if (!shm::is_finite(step.word)) return step.word & ~shm::kForeverFlag;
  const auto judge = judge_before(run, step, models);
  const Nanoseconds time =
      judge == nullptr ? run.start : shm::arrival_of(step.word, judge->timeout(source));
  return time >= 0 && time <= run.start ? time : run.start;
}

std::vector<TraceRow> trace_of(const Run& run, Models& models) {
  std::vector<TraceRow> rows;
  for (const auto& [source, history] : run.sources) {
    for (const Step& step : history.steps) {
      if (step.time >= run.until) break;
      const bool is_initial = step.kind == Step::Kind::state && step.seen <= run.start;
      // What a publisher finds that opens the port may be of long ago.
      const bool ends = shm::is_deactivation(step.word) && step.time > run.start;
      if (is_initial && shm::is_active(step.word, run.start)) {
        rows.push_back({arrival_before(source, step, run, models), &source, false});
      } else if (step.kind == Step::Kind::arrival) {
        rows.push_back({step.time, &source, false});
      } else if (step.kind == Step::Kind::deactivation || (!is_initial && ends)) {
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

// Writes the rows of the arrivals of a run, which come by time.
class DecisionRows {
 public:
  DecisionRows(const Run& run, Models& models, std::ostream& out)
      : run_(run),
        models_(models),
        out_(out),
        winners_(winners_of(run, models)),
        open_(run.port_changes) {}

  void write(const Decision& decision) {
    rules::TraceEvent event;
    event.at = decision.arrival().time;
    event.source = decision.context->source;
    std::map<std::string, bool> delivered;  // by port
    for_each_outcome(run_, decision,
                     [&](const LiveDecision& live) { delivered[*live.port] = live.won; });
    for (std::string& port : sensing_ports(event, decision.arrival().generation)) {
      delivered.try_emplace(std::move(port), false);
    }
    for (const auto& [port, won] : delivered) {
      const std::string& by_time = winners_.at(event.at, port);
      rules::write_outcome(out_, {event, port, {won, won ? event.source : by_time}});
    }
  }

 private:
  // That were open, and read the source without being connected to it: nothing was decided there,
  // but the arrival may have changed who wins.
  std::vector<std::string> sensing_ports(const rules::TraceEvent& event, std::uint64_t generation) {
    std::vector<std::string> ports;
    const auto judge = models_.judge(run_, generation);
    if (judge == nullptr || !judge->simulation().knows(event.source)) return ports;
    const rules::Simulation& simulation = judge->simulation();
    const shm::SourceId source = simulation.source_id(event.source);
    for (const shm::PortId port : simulation.ports_of(event)) {
      if (simulation.table().find(source, port) != shm::kNone) continue;
      const std::string& name = simulation.port_name(port);
      if (is_chosen(run_, name) && open_.has(event.at, name)) ports.push_back(name);
    }
    return ports;
  }

  const Run& run_;
  Models& models_;
  std::ostream& out_;
  WinnersByTime winners_;
  OpenInputs open_;
};

}  // namespace

void write_trace(const Recorded& recorded, Models& models, std::ostream& out) {
  out << "t_ns,source,event\n";
  Nanoseconds last = 0;
  for (const Run& run : recorded.runs) {
    for (const TraceRow& row : trace_of(run, models)) {
      // What is active as a run begins may have arrived while the run before was told.
      last = std::max(last, row.time);
      out << last << ',' << rules::to_csv(*row.source) << ','
          << (row.is_deactivation ? "deactivate" : "arrive") << '\n';
    }
  }
}

void write_decisions(const Recorded& recorded, Models& models, std::ostream& out) {
  rules::write_outcome_header(out);
  for (const Run& run : recorded.runs) {
    DecisionRows rows(run, models, out);
    for (const Decision& decision : run.decisions) {
      if (decision.arrival().time >= run.start) rows.write(decision);
    }
  }
}

}  // namespace arbiter::evidence
