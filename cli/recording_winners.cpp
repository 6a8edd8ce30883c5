#include "cli/recording_winners.hpp"

#include <algorithm>
#include <cstddef>
#include <iostream>
#include <iterator>
#include <map>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include <CLI/CLI.hpp>
#include <nlohmann/json.hpp>

#include "cli/live.hpp"
#include "cli/model_report.hpp"
#include "cli/port_patterns.hpp"
#include "cli/recorded_components.hpp"
#include "cli/recording_part.hpp"
#include "cli/recording_times.hpp"
#include "cli/simulate_recording.hpp"
#include "evidence/recorded.hpp"
#include "rules/model/quantifiers.hpp"
#include "rules/text/names.hpp"
#include "shm/limits.hpp"
#include "shm/utf8.hpp"
#include "watch/process.hpp"

namespace arbiter::cli {
namespace {

using evidence::Recorded;
using nlohmann::ordered_json;

struct RecordedWinners {
  std::string file;
  std::string port;  // a pattern; empty: all
  std::string at;
  PartOptions part;
  bool json = false;
};

// Nothing is recorded of a port that is idle when recording begins: what comes first says that it
// was, if the same model decided.
std::optional<evidence::WinnerChange> idle_before(const evidence::WinnerChange& first,
                                                  const evidence::Run& run) {
  using Why = evidence::WinnerChange::Why;
  const bool is_beginning = first.why == Why::start || first.why == Why::model ||
                            !first.before.empty() || first.time <= run.start;
  if (is_beginning || run.models.empty() || run.models.begin()->first != first.generation) {
    return std::nullopt;
  }
  return evidence::WinnerChange{first.port, "", "", run.start, Why::start, "", first.generation};
}

std::vector<Reign> reigns_of(const Recorded& recorded, const std::string& pattern) {
  std::vector<Reign> all;
  for (const evidence::Run& run : recorded.runs) {
    std::map<std::string, std::vector<const evidence::WinnerChange*>> by_port;
    for (const evidence::WinnerChange& each : run.winners) {
      if (pattern.empty() || rules::matches(pattern, each.port))
        by_port[each.port].push_back(&each);
    }
    for (auto& [port, changes] : by_port) {
      std::stable_sort(changes.begin(), changes.end(),
                       [](const auto* one, const auto* other) { return one->time < other->time; });
      const bool is_last_run = &run == &recorded.runs.back();
      if (const auto idle = idle_before(*changes.front(), run)) {
        all.push_back({*idle, changes.front()->time, false, is_last_run, &run});
      }
      for (std::size_t i = 0; i < changes.size(); ++i) {
        const bool is_last = i + 1 == changes.size();
        const shm::Nanoseconds end =
            is_last ? std::max(run.end, changes[i]->time) : changes[i + 1]->time;
        all.push_back({*changes[i], end, is_last, is_last_run, &run});
      }
    }
  }
  std::stable_sort(all.begin(), all.end(), [](const Reign& one, const Reign& other) {
    return one.change.time < other.change.time;
  });
  return all;
}

// No component and no host has a longer one, and it is told wherever its source wins.
void cut_names(Recorded& recorded) {
  for (evidence::Run& run : recorded.runs) {
    for (auto& [source, changes] : run.output_changes) {
      for (evidence::PortChange& each : changes) {
        for (std::string* name : {&each.node, &each.host}) {
          name->resize(shm::beginning_of(*name, shm::kMaxNameLength).size());
        }
      }
    }
  }
}

// " of nav (pid 4711)", " from host base"; empty: not known.
std::string components_text(const Publishers& publishers) {
  std::string text;
  for (const evidence::PortChange* each : publishers.first) {
    const std::string one = shm::printable(each->host.empty() ? "of " + watch::process_text(*each)
                                                              : "from host " + each->host);
    text += (text.empty() ? " " : ", then ") + one;
  }
  if (publishers.others != 0) text += ", and " + rules::counted(publishers.others, "other");
  return text;
}

ordered_json components_json(const Publishers& publishers) {
  ordered_json list = ordered_json::array();
  for (const evidence::PortChange* each : publishers.first) {
    list.push_back({{"node", each->node},
                    {"pid", each->pid},
                    {"host", each->host.empty() ? ordered_json() : ordered_json(each->host)}});
  }
  return list;
}

// In which something of a source was missed.
class Gaps {
 public:
  explicit Gaps(const Recorded& recorded) {
    for (const evidence::Run& run : recorded.runs) {
      for (const evidence::Missed& gap : run.gaps) {
        shm::Nanoseconds& end = all_[{&run, gap.source}][gap.from];
        end = std::max(end, gap.to);
      }
    }
    for (auto& [source, gaps] : all_) {  // each ends when one before it does, if that is later
      shm::Nanoseconds last = 0;
      for (auto& [from, end] : gaps) last = end = std::max(end, last);
    }
  }
  // A source went inactive in one of its gaps: it may have arrived.
  [[nodiscard]] bool has(const Reign& reign) const {
    return reign.change.why == evidence::WinnerChange::Why::expiry && around(reign).has_value();
  }
  // Of a source of which it was noticed late that it is active: when it may have become so at the
  // earliest.
  [[nodiscard]] std::optional<shm::Nanoseconds> earliest(const Reign& reign) const {
    const bool is_late = reign.change.why == evidence::WinnerChange::Why::state;
    return is_late ? around(reign) : std::nullopt;
  }

 private:
  // Since when something is missing of the source that has made the change; nothing: nothing is.
  [[nodiscard]] std::optional<shm::Nanoseconds> around(const Reign& reign) const {
    const evidence::WinnerChange& change = reign.change;
    const auto gaps = all_.find({reign.run, change.by});
    if (gaps == all_.end()) return std::nullopt;
    const auto behind = gaps->second.upper_bound(change.time);
    if (behind == gaps->second.begin()) return std::nullopt;
    const auto& [from, to] = *std::prev(behind);
    return to >= change.time ? std::optional(from) : std::nullopt;
  }

  // From when to when.
  std::map<std::pair<const evidence::Run*, std::string>,
           std::map<shm::Nanoseconds, shm::Nanoseconds>>
      all_;
};

std::string death_text(const Reign& reign, const evidence::PortChange* death) {
  if (death == nullptr) return "";
  return "; " + shm::printable(watch::process_text(*death)) + " had died " +
         seconds_text(reign.change.time - death->seen) + " before";
}

ordered_json death_json(const evidence::PortChange* death) {
  if (death == nullptr) return nullptr;
  return {{"node", death->node}, {"pid", death->pid}, {"at_ns", death->seen}};
}

std::string new_model_text(const Reign& reign) {
  const auto& models = reign.run->models;
  const auto model = models.find(reign.change.generation);
  if (model != models.end()) return news_text(model->second);
  return "model " + std::to_string(reign.change.generation) + " came into force";
}

std::string cause_text(const Reign& reign, const Gaps& gaps, shm::Nanoseconds offset) {
  const evidence::WinnerChange& change = reign.change;
  const std::string by = shm::printable(change.by);
  switch (change.why) {
    case evidence::WinnerChange::Why::start:
      return "it was so when the recording began";
    case evidence::WinnerChange::Why::arrival:
      return by + " arrived";
    case evidence::WinnerChange::Why::expiry:
      return by + " went inactive" +
             (gaps.has(reign) ? ", unless it arrived in what was missed" : "");
    case evidence::WinnerChange::Why::deactivation:
      return by + " was deactivated";
    case evidence::WinnerChange::Why::model:
      return new_model_text(reign);
    case evidence::WinnerChange::Why::state:
      break;
  }
  const auto earliest = gaps.earliest(reign);
  if (!earliest) return "noticed late";
  return "noticed late: what " + by + " did from " + clock_text(*earliest + offset) +
         " on was missed, so it may have begun since then";
}

std::string length_text(const Reign& reign) {
  std::string text = "for " + seconds_text(reign.end - reign.change.time);
  if (reign.is_cut_off) {
    text += reign.is_of_last_run ? ", until the end of the recording"
                                 : ", until the recording began again";
  }
  return text;
}

std::string nobody_text(const RecordedWinners& options) {
  const std::string then = !options.at.empty()     ? " at " + shm::printable(options.at)
                           : options.part.is_all() ? ""
                                                   : " in that time";
  return "nobody won" + then + ", at " +
         (options.port.empty()
              ? "any input port\n"
              : "an input port that matches " + shm::printable(options.port) + "\n");
}

// A pattern may be misspelt: nobody has won there then.
void warn_of_pattern_without_match(const Recorded& recorded, const std::string& pattern) {
  std::set<std::string_view> ports;
  std::set<std::string_view> sources;
  for (const evidence::Run& run : recorded.runs) {
    for (const evidence::WinnerChange& each : run.winners) ports.insert(each.port);
    for (const evidence::PortChange& each : run.port_changes) ports.insert(each.port);
    for (const auto& [source, history] : run.sources) sources.insert(source);
  }
  warn_without_match("--port", pattern,
                     {{ports.begin(), ports.end()},
                      {sources.begin(), sources.end()},
                      "input port of which the recording tells",
                      "output port: name an input port that it is connected to"});
}

// One by one: each may be much longer than what was recorded of it.
void write_reigns_json(const std::vector<Reign>& reigns, const Gaps& gaps,
                       shm::Nanoseconds offset) {
  Components components;
  const char* before = "[\n  ";
  for (const Reign& reign : reigns) {
    const evidence::WinnerChange& change = reign.change;
    const Publishers publishers = components.of(reign);
    const auto earliest = gaps.earliest(reign);
    ordered_json one{
        {"from", clock_text(change.time + offset)},
        {"from_ns", change.time},
        {"to_ns", reign.end},
        {"cut_off", reign.is_cut_off},
        {"port", change.port},
        {"winner", change.winner.empty() ? ordered_json() : ordered_json(change.winner)},
        {"components", components_json(publishers)},
        {"why", evidence::name_of(change.why)},
        {"by", change.by},
        {"is_in_gap", gaps.has(reign)},
        {"earliest_ns", earliest ? ordered_json(*earliest) : ordered_json()},
        {"died", death_json(components.death_behind(reign))},
        {"generation", change.generation}};
    if (publishers.others != 0) one["other_components"] = publishers.others;
    std::string text = one.dump(2, ' ', false, ordered_json::error_handler_t::replace);
    for (auto end = text.find('\n'); end != std::string::npos; end = text.find('\n', end + 1)) {
      text.insert(end + 1, "  ");
    }
    std::cout << before << text;
    before = ",\n  ";
  }
  std::cout << (reigns.empty() ? "[]\n" : "\n]\n");
}

void write_reigns(const std::vector<Reign>& reigns, const Gaps& gaps, shm::Nanoseconds offset) {
  Components components;
  for (const Reign& reign : reigns) {
    const evidence::WinnerChange& change = reign.change;
    std::cout << clock_text(change.time + offset) << "  " << shm::printable(change.port) << "  "
              << (change.winner.empty() ? "idle" : shm::printable(change.winner))
              << components_text(components.of(reign)) << "  " << length_text(reign) << ": "
              << cause_text(reign, gaps, offset)
              << death_text(reign, components.death_behind(reign)) << '\n';
  }
}

// When it was, so that it can be told whether it matters.
void warn_of_gaps(const Recorded& recorded) {
  std::size_t count = 0;
  shm::Nanoseconds from = shm::kForever;
  shm::Nanoseconds to = 0;
  for (const evidence::Run& run : recorded.runs) {
    count += run.gaps.size();
    for (const evidence::Missed& gap : run.gaps) {
      from = std::min(from, gap.from);
      to = std::max(to, gap.to);
    }
  }
  if (count == 0) return warn_of_missed(recorded);
  const shm::Nanoseconds offset = recorded.about.wall_offset;
  std::cerr << "arbiter: the recorder missed " << evidence::missed_text(recorded)
            << ": who commanded is uncertain in " << rules::counted(count, "gap")
            << (count == 1 ? " from " : " between ") << clock_text(from + offset)
            << (count == 1 ? " to " : " and ") << clock_text(to + offset) << '\n';
}

// Nothing: all of the recording.
std::optional<evidence::TimeSpan> span_of(const RecordedWinners& options,
                                          const RecordedTime& recorded) {
  if (!options.at.empty()) return read_moment(options.at, recorded);
  if (options.part.is_all()) return std::nullopt;
  return read_part(options.part, recorded);
}

int show_winners(const RecordedWinners& options) {
  Recorded recorded = load_winners(options.file);
  cut_names(recorded);
  warn_of_gaps(recorded);
  if (!options.port.empty()) warn_of_pattern_without_match(recorded, options.port);
  std::vector<Reign> reigns = reigns_of(recorded, options.port);
  if (const auto span = span_of(options, time_of(recorded))) {
    std::erase_if(reigns, [&](const Reign& reign) {
      return reign.change.time >= span->to || reign.end <= span->from;
    });
  }
  const shm::Nanoseconds offset = recorded.about.wall_offset;
  const Gaps gaps(recorded);
  if (options.json) {
    write_reigns_json(reigns, gaps, offset);
  } else {
    write_reigns(reigns, gaps, offset);
    if (reigns.empty()) std::cout << nobody_text(options);
  }
  return 0;
}

}  // namespace

void add_recorded_winners(CLI::App& parent, int& exit_code) {
  const auto options = std::make_shared<RecordedWinners>();
  CLI::App* verb = parent.add_subcommand("winners", "Show who commanded when, by the wall clock");
  verb->add_option("FILE", options->file, "A recording that `arbiter record` has made")->required();
  auto* at =
      verb->add_option("--at", options->at,
                       "Only at this time of day, in your time zone (TZ): 14:03:07 (all of that "
                       "second), 14:03:07.250, '2026-11-22 14:03:07'")
          ->type_name("TIME");
  for (auto* each : add_part_options(*verb, options->part)) each->excludes(at);
  verb->add_option("--port", options->port, "Only at input ports that match this pattern")
      ->type_name("PATTERN");
  verb->add_flag("--json", options->json,
                 "A list of {from, from_ns, to_ns, cut_off, port, winner, components, why, by, "
                 "is_in_gap, earliest_ns, died, generation}");
  verb->footer(
      "Example:\n  arbiter recording winners incident.mcap --at 14:03:07\n\n"
      "Exit codes: 0 shown; 1 a file that `arbiter record` has not made; 2 wrong use, a time that "
      "is not in\nthe recording, or a file that cannot be read");
  verb->callback([options, &exit_code] { exit_code = show_winners(*options); });
}

}  // namespace arbiter::cli
