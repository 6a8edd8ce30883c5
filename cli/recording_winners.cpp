#include "cli/recording_winners.hpp"

#include <time.h>

#include <algorithm>
#include <array>
#include <cstddef>
#include <iostream>
#include <map>
#include <memory>
#include <optional>
#include <sstream>
#include <string>
#include <vector>

#include <CLI/CLI.hpp>
#include <nlohmann/json.hpp>

#include "cli/live.hpp"
#include "cli/recording_times.hpp"
#include "cli/simulate_recording.hpp"
#include "evidence/recorded.hpp"
#include "rules/model/quantifiers.hpp"
#include "rules/text/names.hpp"
#include "shm/utf8.hpp"

namespace arbiter::cli {
namespace {

using evidence::Recorded;
using nlohmann::ordered_json;

constexpr shm::Nanoseconds kWholeSecond = 1'000'000'000;

struct RecordedWinners {
  std::string file;
  std::string port;  // a pattern; empty: all
  std::string at;
  bool json = false;
};

// From a change to the next, or to the end of the run.
struct Reign {
  const evidence::WinnerChange* change = nullptr;
  shm::Nanoseconds end = 0;
};

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
      for (std::size_t i = 0; i < changes.size(); ++i) {
        const shm::Nanoseconds end =
            i + 1 < changes.size() ? changes[i + 1]->time : std::max(run.end, changes[i]->time);
        all.push_back({changes[i], end});
      }
    }
  }
  std::stable_sort(all.begin(), all.end(), [](const Reign& one, const Reign& other) {
    return one.change->time < other.change->time;
  });
  return all;
}

// What was asked for with --at, as times of the recording: a moment, or all of a second.
struct Span {
  shm::Nanoseconds from = 0;
  shm::Nanoseconds to = 0;
};

[[noreturn]] void fail_at(const std::string& text, const std::string& why) {
  throw CLI::ValidationError("--at", rules::quote(text) + ' ' + why);
}

std::optional<shm::Nanoseconds> fraction_of(const char* rest) {
  if (*rest == '\0') return 0;
  const std::string digits = *rest == '.' ? rest + 1 : "";
  if (digits.empty() || digits.size() > 9 ||
      digits.find_first_not_of("0123456789") != std::string::npos) {
    return std::nullopt;
  }
  return std::stoll(digits + std::string(9 - digits.size(), '0'));
}

// By the wall clock, in this time zone; without a date, the first such time from the beginning of
// the recording on.
Span read_moment(const std::string& text, const Recorded& recorded) {
  const shm::Nanoseconds offset = recorded.about.wall_offset;
  const shm::Nanoseconds begin = recorded.runs.front().start + offset;
  const shm::Nanoseconds end = recorded.runs.back().end + offset;
  for (const char* format : {"%Y-%m-%d %H:%M:%S", "%Y-%m-%dT%H:%M:%S", "%H:%M:%S"}) {
    const std::time_t first = begin / kWholeSecond;
    std::tm parts{};
    localtime_r(&first, &parts);
    const char* const rest = strptime(text.c_str(), format, &parts);
    const auto fraction = rest == nullptr ? std::nullopt : fraction_of(rest);
    if (!fraction) continue;
    parts.tm_isdst = -1;
    std::tm day_after = parts;
    ++day_after.tm_mday;
    shm::Nanoseconds wall = std::mktime(&parts) * kWholeSecond;
    if (format[1] == 'H' && wall + kWholeSecond <= begin)
      wall = std::mktime(&day_after) * kWholeSecond;
    const bool is_whole_second = *rest == '\0';
    const Span span{wall + *fraction, wall + *fraction + (is_whole_second ? kWholeSecond : 1)};
    if (span.to <= begin || span.from > end) {
      fail_at(text, "is not in the recording, which is from " + clock_text(begin) + " to " +
                        clock_text(end));
    }
    return {span.from - offset, span.to - offset};
  }
  fail_at(text, "is not a time: write 14:03:07, 14:03:07.250 or 2026-11-22 14:03:07");
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

int show_winners(const RecordedWinners& options) {
  const Recorded recorded = load_for_simulation(options.file);
  warn_of_missed(recorded);
  std::vector<Reign> reigns = reigns_of(recorded, options.port);
  if (!options.at.empty()) {
    const Span span = read_moment(options.at, recorded);
    std::erase_if(reigns, [&](const Reign& reign) {
      return reign.change->time >= span.to || reign.end <= span.from;
    });
  }
  const shm::Nanoseconds offset = recorded.about.wall_offset;
  if (options.json) {
    ordered_json list = ordered_json::array();
    for (const Reign& reign : reigns) {
      const evidence::WinnerChange& change = *reign.change;
      list.push_back(
          {{"from", clock_text(change.time + offset)},
           {"from_ns", change.time},
           {"to_ns", reign.end},
           {"port", change.port},
           {"winner", change.winner.empty() ? ordered_json() : ordered_json(change.winner)},
           {"why", evidence::name_of(change.why)},
           {"by", change.by},
           {"generation", change.generation}});
    }
    std::cout << list.dump(2, ' ', false, ordered_json::error_handler_t::replace) << '\n';
    return 0;
  }
  std::ostringstream out;
  for (const Reign& reign : reigns) {
    const evidence::WinnerChange& change = *reign.change;
    out << clock_text(change.time + offset) << "  " << shm::printable(change.port) << "  "
        << (change.winner.empty() ? "idle" : shm::printable(change.winner)) << "  for "
        << seconds_text(reign.end - change.time) << ": " << cause_text(change) << '\n';
  }
  if (reigns.empty()) out << "no arbitrated input port of the recording matches\n";
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
                 "A list of {from, from_ns, to_ns, port, winner, why, by, generation}");
  verb->footer(
      "Exit codes: 0 shown; 2 wrong use, a time that is not in the recording, or a file that\n"
      "cannot be read\n\n"
      "Example:\n  arbiter recording winners incident.mcap --at 14:03:07");
  verb->callback([options, &exit_code] { exit_code = show_winners(*options); });
}

}  // namespace arbiter::cli
