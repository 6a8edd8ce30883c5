#include "cli/recording_winners.hpp"

#include <algorithm>
#include <iostream>
#include <map>
#include <memory>
#include <optional>
#include <set>
#include <sstream>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include <CLI/CLI.hpp>
#include <nlohmann/json.hpp>

#include "cli/live.hpp"
#include "cli/port_patterns.hpp"
#include "cli/recording_times.hpp"
#include "cli/simulate_recording.hpp"
#include "evidence/recorded.hpp"
#include "rules/model/quantifiers.hpp"
#include "rules/text/names.hpp"
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
  bool json = false;
};

// From a change to the next, or to the end of the run.
struct Reign {
  evidence::WinnerChange change;
  shm::Nanoseconds end = 0;
  bool is_cut_off = false;  // by the end of the run: how long it went on is not known
  bool is_of_last_run = false;
  const evidence::Run* run = nullptr;
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

// A component has an output port open. It is seen a little later than it happens.
struct Ownership {
  const evidence::PortChange* opening = nullptr;
  shm::Nanoseconds until = shm::kForever;

  [[nodiscard]] shm::Nanoseconds since() const { return opening->seen; }
};

std::vector<Ownership> ownerships_of(const evidence::Run& run, const std::string& source) {
  using What = evidence::PortChange::What;
  std::vector<Ownership> all;
  const auto changes = run.output_changes.find(source);
  if (changes == run.output_changes.end()) return all;
  for (const evidence::PortChange& each : changes->second) {
    const bool is_opening = each.what == What::open || each.what == What::opened;
    const bool ends_last = !all.empty() && all.back().until == shm::kForever &&
                           (is_opening || all.back().opening->pid == each.pid);
    if (ends_last) all.back().until = each.seen;
    // One that nobody saw open may have died all the same.
    if (is_opening || (!ends_last && each.what == What::died)) {
      all.push_back({&each, is_opening ? shm::kForever : each.seen});
    }
  }
  return all;
}

// Who had each source open, found out once for all that it won.
class Components {
 public:
  // Who published what won. A source may win after its component has gone.
  [[nodiscard]] std::vector<const evidence::PortChange*> of(const Reign& reign);

 private:
  std::map<std::pair<const evidence::Run*, std::string>, std::vector<Ownership>> known_;
};

std::vector<const evidence::PortChange*> Components::of(const Reign& reign) {
  const evidence::WinnerChange& change = reign.change;
  const bool begins_itself =
      change.why == evidence::WinnerChange::Why::arrival && change.by == change.winner;
  const auto [known, is_new] = known_.try_emplace({reign.run, change.winner});
  if (is_new) known->second = ownerships_of(*reign.run, change.winner);
  const evidence::PortChange* before = nullptr;
  std::vector<const evidence::PortChange*> found;
  for (const Ownership& each : known->second) {
    if (each.until <= change.time) {
      before = each.opening;
    } else if (each.since() < reign.end || (found.empty() && begins_itself)) {
      if (found.empty() && each.since() > change.time && !begins_itself && before != nullptr) {
        found.push_back(before);
      }
      found.push_back(each.opening);
    }
  }
  if (found.empty() && before != nullptr) found.push_back(before);
  return found;
}

// " of nav (pid 4711)", " from host base"; empty: not known.
std::string components_text(const std::vector<const evidence::PortChange*>& components) {
  std::string text;
  for (const evidence::PortChange* each : components) {
    const std::string one = shm::printable(each->host.empty() ? "of " + watch::process_text(*each)
                                                              : "from host " + each->host);
    text += (text.empty() ? " " : ", then ") + one;
  }
  return text;
}

ordered_json components_json(const std::vector<const evidence::PortChange*>& components) {
  ordered_json list = ordered_json::array();
  for (const evidence::PortChange* each : components) {
    list.push_back({{"node", each->node},
                    {"pid", each->pid},
                    {"host", each->host.empty() ? ordered_json() : ordered_json(each->host)}});
  }
  return list;
}

// Who had the source open that went inactive, and died; null: nobody did.
const evidence::PortChange* death_behind(const Reign& reign) {
  const evidence::WinnerChange& change = reign.change;
  const auto changes = reign.run->output_changes.find(change.by);
  if (change.why != evidence::WinnerChange::Why::expiry ||
      changes == reign.run->output_changes.end()) {
    return nullptr;
  }
  const evidence::PortChange* last = nullptr;
  for (const evidence::PortChange& each : changes->second) {
    if (each.seen <= change.time) last = &each;
  }
  const bool has_died = last != nullptr && last->what == evidence::PortChange::What::died;
  return has_died ? last : nullptr;
}

std::string death_text(const Reign& reign) {
  const evidence::PortChange* death = death_behind(reign);
  if (death == nullptr) return "";
  return "; " + shm::printable(watch::process_text(*death)) + " had died " +
         seconds_text(reign.change.time - death->seen) + " before";
}

ordered_json death_json(const Reign& reign) {
  const evidence::PortChange* death = death_behind(reign);
  if (death == nullptr) return nullptr;
  return {{"node", death->node}, {"pid", death->pid}, {"at_ns", death->seen}};
}

std::string cause_text(const evidence::WinnerChange& change) {
  const std::string by = shm::printable(change.by);
  switch (change.why) {
    case evidence::WinnerChange::Why::start:
      return "it was so when the recording began";
    case evidence::WinnerChange::Why::arrival:
      return by + " arrived";
    case evidence::WinnerChange::Why::expiry:
      return by + " went inactive";
    case evidence::WinnerChange::Why::deactivation:
      return by + " was deactivated";
    case evidence::WinnerChange::Why::model:
      return "model " + std::to_string(change.generation) + " came into force";
    case evidence::WinnerChange::Why::state:
      break;
  }
  return "noticed late";
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
  return "nobody won" + (options.at.empty() ? "" : " at " + shm::printable(options.at)) + ", at " +
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

int show_winners(const RecordedWinners& options) {
  const Recorded recorded = load_for_simulation(options.file);
  warn_of_missed(recorded);
  if (!options.port.empty()) warn_of_pattern_without_match(recorded, options.port);
  std::vector<Reign> reigns = reigns_of(recorded, options.port);
  if (!options.at.empty()) {
    const TimeSpan span = read_moment(options.at, recorded.runs.front().start,
                                      recorded.runs.back().end, recorded.about.wall_offset);
    std::erase_if(reigns, [&](const Reign& reign) {
      return reign.change.time >= span.to || reign.end <= span.from;
    });
  }
  const shm::Nanoseconds offset = recorded.about.wall_offset;
  Components components;
  if (options.json) {
    ordered_json list = ordered_json::array();
    for (const Reign& reign : reigns) {
      const evidence::WinnerChange& change = reign.change;
      list.push_back(
          {{"from", clock_text(change.time + offset)},
           {"from_ns", change.time},
           {"to_ns", reign.end},
           {"cut_off", reign.is_cut_off},
           {"port", change.port},
           {"winner", change.winner.empty() ? ordered_json() : ordered_json(change.winner)},
           {"components", components_json(components.of(reign))},
           {"why", evidence::name_of(change.why)},
           {"by", change.by},
           {"died", death_json(reign)},
           {"generation", change.generation}});
    }
    std::cout << list.dump(2, ' ', false, ordered_json::error_handler_t::replace) << '\n';
    return 0;
  }
  std::ostringstream out;
  for (const Reign& reign : reigns) {
    const evidence::WinnerChange& change = reign.change;
    out << clock_text(change.time + offset) << "  " << shm::printable(change.port) << "  "
        << (change.winner.empty() ? "idle" : shm::printable(change.winner))
        << components_text(components.of(reign)) << "  " << length_text(reign) << ": "
        << cause_text(change) << death_text(reign) << '\n';
  }
  if (reigns.empty()) out << nobody_text(options);
  std::cout << out.str();
  return 0;
}

}  // namespace

void add_recorded_winners(CLI::App& parent, int& exit_code) {
  const auto options = std::make_shared<RecordedWinners>();
  CLI::App* verb = parent.add_subcommand("winners", "Show who commanded when, by the wall clock");
  verb->add_option("FILE", options->file, "A recording that `arbiter record` has made")->required();
  verb->add_option("--at", options->at,
                   "Only at this time of day, in your time zone (TZ): 14:03:07 (all of that "
                   "second), 14:03:07.250, '2026-11-22 14:03:07'")
      ->type_name("TIME");
  verb->add_option("--port", options->port, "Only at input ports that match this pattern")
      ->type_name("PATTERN");
  verb->add_flag("--json", options->json,
                 "A list of {from, from_ns, to_ns, cut_off, port, winner, components, why, by, "
                 "died, generation}");
  verb->footer(
      "Example:\n  arbiter recording winners incident.mcap --at 14:03:07\n\n"
      "Exit codes: 0 shown; 1 a file that `arbiter record` has not made; 2 wrong use, a time that "
      "is not in\nthe recording, or a file that cannot be read");
  verb->callback([options, &exit_code] { exit_code = show_winners(*options); });
}

}  // namespace arbiter::cli
