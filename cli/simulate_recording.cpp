#include "cli/simulate_recording.hpp"

#include <time.h>

#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <iostream>
#include <memory>
#include <sstream>
#include <stdexcept>
#include <utility>

#include <nlohmann/json.hpp>

#include "cli/live.hpp"
#include "cli/model_files.hpp"
#include "cli/numbers.hpp"
#include "cli/recording_compile.hpp"
#include "evidence/comparison.hpp"
#include "evidence/models.hpp"
#include "evidence/recorded.hpp"
#include "evidence/verification.hpp"
#include "rules/ask/report.hpp"
#include "shm/utf8.hpp"

namespace arbiter::cli {
namespace {

using evidence::Recorded;
using nlohmann::ordered_json;

shm::Nanoseconds first_arrival(const Recorded& recorded) {
  for (const auto& run : recorded.runs) {
    if (!run.decisions.empty()) return run.decisions.front().arrival().time;
  }
  return recorded.runs.front().start;
}

// "1.500000000 s", to the nanosecond.
std::string exact_seconds(shm::Nanoseconds span) {
  char text[64];
  std::snprintf(text, sizeof text, "%lld.%09lld s", static_cast<long long>(span / 1'000'000'000),
                static_cast<long long>(span % 1'000'000'000));
  return text;
}

// Of `time` since the first arrival: "+1.500000000 s".
std::string since_first(const Recorded& recorded, shm::Nanoseconds time) {
  const shm::Nanoseconds span = time - first_arrival(recorded);
  return (span < 0 ? "-" : "+") + exact_seconds(std::abs(span));
}

std::string wall_text(const Recorded& recorded, shm::Nanoseconds time) {
  const std::time_t seconds = (time + recorded.about.wall_offset) / 1'000'000'000;
  std::tm parts{};
  gmtime_r(&seconds, &parts);
  char text[64];
  std::strftime(text, sizeof text, "%Y-%m-%d %H:%M:%S UTC", &parts);
  return text;
}

std::string who(const std::string& winner) {
  return winner.empty() ? "nobody" : shm::printable(winner);
}

std::string about(const evidence::LiveDecision& live) {
  const auto& decision = *live.decision;
  return shm::printable(decision.context->source) +
         (decision.is_sample ? " #" : " (a signal after #") + std::to_string(decision.sequence) +
         (decision.is_sample ? "" : ")") + " at " + shm::printable(*live.port);
}

std::size_t arrivals_of(const Recorded& recorded) {
  std::size_t arrivals = 0;
  for (const auto& run : recorded.runs) arrivals += run.decisions.size();
  return arrivals;
}

void write_head(const Recorded& recorded) {
  std::size_t sources = 0;
  std::uint64_t lost = 0;
  for (const auto& run : recorded.runs) {
    sources = std::max(sources, run.sources.size());
    lost += run.lost;
  }
  const shm::Nanoseconds start = recorded.runs.front().start;
  std::cout << "recording of instance \"" << shm::printable(recorded.about.instance) << "\", from "
            << wall_text(recorded, start) << ", " << seconds_text(recorded.runs.back().end - start)
            << ": " << counted(sources, "source") << ", "
            << counted(arrivals_of(recorded), "arrival") << '\n';
  if (lost != 0) std::cout << "the recorder missed " << counted(lost, "event") << '\n';
}

ordered_json to_json(const Recorded& recorded, const evidence::LiveDecision& live) {
  const auto& arrival = live.decision->arrival();
  return {{"time_ns", arrival.time},
          {"since_first", since_first(recorded, arrival.time)},
          {"source", live.decision->context->source},
          {"sequence", live.decision->sequence},
          {"kind", live.decision->is_sample ? "sample" : "signal"},
          {"port", *live.port},
          {"live", live.won ? "delivered" : "discarded"},
          {"generation", arrival.generation}};
}

// Where there is no decision.
std::string nothing_to_compare(const Recorded& recorded) {
  return arrivals_of(recorded) == 0
             ? "nothing to compare: nothing arrived while it was recorded\n"
             : "nothing to compare: no input port was open while it was recorded\n";
}

// Where none is different.
std::string verdict_line(const Recorded& recorded, const evidence::Verification& result) {
  if (result.all() == 0) return nothing_to_compare(recorded);
  const bool are_all_judged = result.blind + result.behind_gap + result.without_model == 0;
  return are_all_judged ? "every decision is reproduced\n" : "no decision is contradicted\n";
}

int write_verification(const Recorded& recorded, const evidence::Verification& result,
                       bool as_json) {
  const int exit_code = result.different == 0 && result.all() != 0 ? 0 : 1;
  if (as_json) {
    ordered_json answer{{"decisions", result.all()},       {"equal", result.equal},
                        {"overlapped", result.overlapped}, {"blind", result.blind},
                        {"behind_gap", result.behind_gap}, {"without_model", result.without_model},
                        {"different", result.different},   {"first", nullptr}};
    if (result.first) {
      answer["first"] = to_json(recorded, result.first->live);
      answer["first"]["text"] = result.first->text;
    }
    std::cout << answer.dump(2, ' ', false, ordered_json::error_handler_t::replace) << '\n';
    return exit_code;
  }
  write_head(recorded);
  std::ostringstream out;
  out << counted(result.all(), "decision") << ": " << result.equal << " equal, "
      << result.overlapped << " overlapped, " << result.blind << " blind, " << result.behind_gap
      << " behind a gap";
  if (result.without_model != 0) out << ", " << result.without_model << " of unknown models";
  if (result.different != 0) out << ", " << result.different << " different";
  out << '\n';
  if (result.first) {
    const auto& live = result.first->live;
    out << "the first that differs, " << since_first(recorded, live.decision->arrival().time)
        << " (generation " << live.decision->arrival().generation << "):\n  " << about(live)
        << " was " << (live.won ? "delivered" : "discarded") << "; "
        << shm::printable(result.first->text) << '\n';
  } else {
    out << verdict_line(recorded, result);
  }
  std::cout << out.str();
  return exit_code;
}

const char* outcome(bool delivered) { return delivered ? "delivered" : "discarded"; }

void write_json(const Recorded& recorded, const evidence::Comparison& result) {
  ordered_json changed = ordered_json::array();
  for (const auto& each : result.changed) {
    ordered_json one = to_json(recorded, each.live);
    one["other"] = outcome(!each.live.won);
    one["is_connected"] = each.is_connected;
    changed.push_back(std::move(one));
  }
  ordered_json intervals = ordered_json::array();
  for (const auto& each : result.intervals) {
    intervals.push_back({{"port", each.port},
                         {"from_ns", each.from},
                         {"to_ns", each.to},
                         {"since_first", since_first(recorded, each.from)},
                         {"recorded", each.recorded},
                         {"other", each.other}});
  }
  std::cout << ordered_json{{"decisions", result.decisions},
                            {"same", result.same},
                            {"uncertain", result.uncertain},
                            {"changed", std::move(changed)},
                            {"winner_intervals", std::move(intervals)}}
                   .dump(2, ' ', false, ordered_json::error_handler_t::replace)
            << '\n';
}

int write_comparison(const Recorded& recorded, const evidence::Comparison& result, bool as_json) {
  const bool is_same = result.decisions != 0 && result.changed.empty() && result.intervals.empty();
  if (as_json) {
    write_json(recorded, result);
    return is_same ? 0 : 1;
  }
  write_head(recorded);
  std::cout << counted(result.decisions, "decision") << ": " << result.same << " the same, "
            << result.changed.size() << " changed, " << result.uncertain << " uncertain\n";
  if (result.decisions == 0) std::cout << nothing_to_compare(recorded);
  for (const auto& each : result.changed) {
    std::cout << "  " << since_first(recorded, each.live.decision->arrival().time) << "  "
              << about(each.live) << ": " << outcome(!each.live.won) << " instead of "
              << outcome(each.live.won) << (each.is_connected ? "" : " (not connected)") << '\n';
  }
  std::cout << (result.intervals.empty() ? "the winners are the same throughout\n"
                                         : "the winner differs:\n");
  for (const auto& each : result.intervals) {
    std::cout << "  " << since_first(recorded, each.from) << " to "
              << since_first(recorded, each.to) << "  " << shm::printable(each.port) << ": "
              << who(each.other) << " instead of " << who(each.recorded) << '\n';
  }
  return is_same ? 0 : 1;
}

}  // namespace

int simulate_recording(const SimulateRecordingOptions& options) {
  const Recorded recorded = evidence::load_recording(options.recording);
  if (!recorded.about.end.is_whole) {
    std::cerr << "arbiter: " << shm::printable(options.recording) << ": "
              << shm::printable(recorded.about.end.problem) << "; what comes before is used\n";
  }
  if (recorded.runs.empty()) throw evidence::RecordError(options.recording + " is empty");
  evidence::Models models(recording_compiler(options.effort));
  if (options.other.models.empty()) {
    return write_verification(recorded, evidence::verify(recorded, models), options.json);
  }
  rules::Diagnostics diagnostics;
  const auto other = load_model(options.other, diagnostics, options.effort);
  rules::write_text(std::cerr, diagnostics);
  if (!other) return 1;
  evidence::Judge judge(other->compiled, true);
  return write_comparison(recorded, evidence::compare(recorded, models, judge), options.json);
}

}  // namespace arbiter::cli
