#include "cli/simulate_recording.hpp"

#include <algorithm>
#include <cstdint>
#include <iostream>
#include <map>
#include <set>
#include <sstream>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include <nlohmann/json.hpp>

#include "cli/live.hpp"
#include "cli/model_files.hpp"
#include "cli/progress.hpp"
#include "cli/recording_compile.hpp"
#include "cli/recording_times.hpp"
#include "evidence/comparison.hpp"
#include "evidence/models.hpp"
#include "evidence/recorded.hpp"
#include "evidence/verification.hpp"
#include "rules/ask/report.hpp"
#include "rules/text/names.hpp"
#include "shm/utf8.hpp"

namespace arbiter::cli {
namespace {

using evidence::Recorded;
using evidence::TimeSpan;
using nlohmann::ordered_json;

std::string who(const std::string& winner) {
  return winner.empty() ? "nobody" : shm::printable(winner);
}

// "#7", "a signal after #7".
std::string arrival_text(const evidence::LiveDecision& live) {
  return (live.decision->is_sample ? "#" : "a signal after #") +
         std::to_string(live.decision->sequence);
}

std::string about(const evidence::LiveDecision& live) {
  const std::string arrival = arrival_text(live);
  return shm::printable(live.decision->context->source) + " " +
         (live.decision->is_sample ? arrival : "(" + arrival + ")") + " at " +
         shm::printable(*live.port);
}

std::size_t arrivals_of(const Recorded& recorded) {
  std::size_t arrivals = 0;
  for (const auto& run : recorded.runs) arrivals += run.decisions.size();
  return arrivals;
}

void write_head(const Recorded& recorded) {
  std::size_t sources = 0;
  for (const auto& run : recorded.runs) sources = std::max(sources, run.sources.size());
  const shm::Nanoseconds start = recorded.runs.front().start;
  std::cout << "recording of instance \"" << shm::printable(recorded.about.instance) << "\", from "
            << wall_text(recorded, start) << ", " << seconds_text(recorded.runs.back().end - start)
            << ": " << rules::counted(sources, "source") << ", "
            << rules::counted(arrivals_of(recorded), "arrival") << '\n';
  const std::string missed = evidence::missed_text(recorded);
  if (!missed.empty()) std::cout << "the recorder missed " << missed << '\n';
  std::uint64_t left_out = 0;
  for (const auto& run : recorded.runs) left_out += run.left_out;
  if (left_out != 0) {
    std::cout << rules::counted(left_out, "arrival") << (left_out == 1 ? " is" : " are")
              << " left out: another daemon had come, and the recorder did not know it yet\n";
  }
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

bool had_open_input(const Recorded& recorded) {
  using What = evidence::PortChange::What;
  const auto opens = [](const evidence::PortChange& each) {
    return each.what == What::open || each.what == What::opened;
  };
  return std::any_of(recorded.runs.begin(), recorded.runs.end(), [&](const evidence::Run& run) {
    return std::any_of(run.port_changes.begin(), run.port_changes.end(), opens);
  });
}

// Where there is no decision.
std::string nothing_to_compare(const Recorded& recorded) {
  if (arrivals_of(recorded) == 0) {
    return "nothing to compare: nothing arrived while it was recorded\n";
  }
  return had_open_input(recorded)
             ? "nothing to compare: what arrived was not connected to an open input port\n"
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
  out << rules::counted(result.all(), "decision") << ": " << result.equal << " equal, "
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
    one["was_connected"] = each.was_connected;
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

// Decisions of one connection that have changed in the same way, one after the other.
struct Series {
  const evidence::ChangedDecision* first = nullptr;
  const evidence::ChangedDecision* last = nullptr;
  std::uint64_t count = 0;
};

// By their first decisions. `folds`: else each stands alone.
std::vector<Series> series_of(const evidence::Comparison& result, bool folds) {
  std::vector<Series> all;
  std::map<std::pair<std::string_view, std::string_view>, std::size_t> last;
  for (const auto& each : result.changed) {
    const auto& live = each.live;
    const auto [known, is_new] =
        last.try_emplace({live.decision->context->source, *live.port}, all.size());
    if (folds && !is_new && each.goes_on) {
      Series& series = all[known->second];
      series.last = &each;
      ++series.count;
      continue;
    }
    known->second = all.size();
    all.push_back({&each, &each, 1});
  }
  return all;
}

// Nothing where a publisher has begun to count anew.
std::string numbers_text(const Series& series) {
  const evidence::LiveDecision &first = series.first->live, &last = series.last->live;
  const std::uint64_t begin = first.decision->sequence, end = last.decision->sequence;
  if (end <= begin || end - begin + 1 < series.count) return "";
  return " (" + arrival_text(first) + " to " + arrival_text(last) + ")";
}

void write_changed(const Recorded& recorded, const evidence::Comparison& result, bool each) {
  if (result.changed.empty()) return;
  std::cout << "these decisions change:\n";
  for (const Series& series : series_of(result, !each)) {
    const auto& live = series.first->live;
    const auto time = [&](const evidence::ChangedDecision* one) {
      return since_first(recorded, one->live.decision->arrival().time);
    };
    std::cout << "  " << time(series.first);
    if (series.count == 1) {
      std::cout << "  " << about(live) << ": ";
    } else {
      std::cout << " to " << time(series.last) << "  "
                << shm::printable(live.decision->context->source) << ", "
                << rules::counted(series.count, "arrival") << numbers_text(series) << " at "
                << shm::printable(*live.port) << ": ";
    }
    std::cout << outcome(!live.won) << " instead of "
              << (series.first->was_connected ? outcome(live.won) : "not connected")
              << (series.first->is_connected ? "" : " (not connected)") << '\n';
  }
}

void write_intervals(const Recorded& recorded, const evidence::Comparison& result) {
  std::cout << (result.intervals.empty() ? "the winners are the same throughout\n"
                                         : "the winner differs:\n");
  for (const auto& each : result.intervals) {
    std::cout << "  " << since_first(recorded, each.from) << " to "
              << since_first(recorded, each.to) << "  " << shm::printable(each.port) << ": "
              << who(each.other) << " instead of " << who(each.recorded) << '\n';
  }
}

int write_comparison(const Recorded& recorded, const evidence::Comparison& result,
                     const SimulateRecordingOptions& options) {
  const bool is_same = result.decisions != 0 && result.changed.empty() && result.intervals.empty();
  if (options.json) {
    write_json(recorded, result);
    return is_same ? 0 : 1;
  }
  write_head(recorded);
  std::cout << rules::counted(result.decisions, "decision") << ": " << result.same << " the same, "
            << result.changed.size() << " changed, " << result.uncertain << " uncertain\n";
  if (result.decisions == 0) std::cout << nothing_to_compare(recorded);
  write_intervals(recorded, result);
  write_changed(recorded, result, options.each);
  return is_same ? 0 : 1;
}

// A model of another robot decides everything differently, which tells nothing about either.
void warn_of_other_ports(const Recorded& recorded, const evidence::Judge& judge) {
  std::set<std::string> ports;
  for (const evidence::Run& run : recorded.runs) {
    evidence::for_each_decision(
        run, [&](const evidence::LiveDecision& live) { ports.insert(*live.port); });
  }
  const auto has = [&](const std::string& port) {
    return judge.simulation().find_port(port).has_value();
  };
  if (ports.empty() || std::any_of(ports.begin(), ports.end(), has)) return;
  std::cerr << "arbiter: warning: the model has none of the input ports of the recording: "
            << shm::printable(rules::enumerate({ports.begin(), ports.end()})) << '\n';
}

Recorded load(const std::string& path, evidence::Wanted wanted, const TimeSpan& part) {
  ProgressLine line;
  Recorded recorded =
      evidence::load_recording(path, line.watch("reading the recording"), wanted, part);
  if (!recorded.runs.empty()) return recorded;
  throw evidence::RecordError(
      path + (part.from == 0 ? " is empty" : ": nothing was recorded in that time"));
}

void say_damage(const std::string& path, const Recorded& recorded) {
  if (recorded.about.end.is_whole) return;
  std::cerr << "arbiter: " << shm::printable(path) << ": "
            << shm::printable(recorded.about.end.problem) << "; what comes before is used\n";
}

// A model that is compiled meanwhile has a line of its own.
template <class Take>
auto take_again(const Take& take) {
  ProgressLine line;
  return take(line.watch("taking the decisions again"));
}

}  // namespace

Recorded load_winners(const std::string& path) {
  Recorded recorded = load(path, evidence::Wanted::winners, {});
  say_damage(path, recorded);
  return recorded;
}

// When it begins and ends, by which times of day are understood, only the whole file tells.
TimeSpan part_of(const std::string& path, const PartOptions& options) {
  if (options.is_all()) return {};
  return read_part(options, time_of(load(path, evidence::Wanted::winners, {})));
}

Recorded load_for_simulation(const std::string& path, const PartOptions& part) {
  Recorded recorded = load(path, evidence::Wanted::all, part_of(path, part));
  say_damage(path, recorded);
  return recorded;
}

void warn_of_missed(const Recorded& recorded) {
  const std::string missed = evidence::missed_text(recorded);
  if (missed.empty()) return;
  std::cerr << "arbiter: the recorder missed " << missed
            << ": statements about the time around the gaps may be wrong\n";
}

int simulate_recording(const SimulateRecordingOptions& options) {
  const Recorded recorded = load_for_simulation(options.recording, options.part);
  evidence::Models models(recording_compiler(options.effort));
  if (options.other.models.empty()) {
    const auto result = take_again(
        [&](const recording::Watch& watch) { return evidence::verify(recorded, models, watch); });
    return write_verification(recorded, result, options.json);
  }
  rules::Diagnostics diagnostics;
  const auto other = load_model(options.other, diagnostics, options.effort);
  rules::write_text(std::cerr, diagnostics);
  if (!other) return 1;
  evidence::Judge judge(other->compiled, true);
  warn_of_other_ports(recorded, judge);
  const auto result = take_again([&](const recording::Watch& watch) {
    return evidence::compare(recorded, models, judge, watch);
  });
  return write_comparison(recorded, result, options);
}

}  // namespace arbiter::cli
