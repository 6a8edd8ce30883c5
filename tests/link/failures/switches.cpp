#include "tests/link/failures/switches.hpp"

#include <algorithm>

#include <nlohmann/json.hpp>

namespace arbiter::failures {
namespace {

// A link that was told to commit hears from its daemon within that time, or not at all, unless
// one of the two is held up.
constexpr Nanoseconds kAnswerOfDaemon = 3 * kSecond;

// A model that was in force for less than that, the recorder may have missed.
constexpr Nanoseconds kReplaced = 100 * kMs;

struct Told {
  enum class Outcome : std::uint8_t { none, switched, not_switched, unknown };
  Outcome outcome = Outcome::none;
  bool has_prepared = false;
  std::uint64_t generation = 0;
};

// What the operator was told.
struct Report {
  const SwitchTried* tried = nullptr;
  bool is_committed = false;
  bool is_known = false;  // else the operator was told nothing: it had no link
  std::vector<Told> hosts;

  // Of all hosts: the worst.
  [[nodiscard]] bool has(Told::Outcome outcome) const {
    return std::any_of(hosts.begin(), hosts.end(),
                       [&](const Told& each) { return each.outcome == outcome; });
  }
};

Report report_of(const SwitchTried& tried, std::size_t hosts) {
  Report report;
  report.tried = &tried;
  report.hosts.resize(hosts);
  if (tried.report.empty()) return report;
  const auto json = nlohmann::json::parse(tried.report);
  report.is_known = true;
  report.is_committed = json["committed"];
  for (const auto& each : json["hosts"]) {
    for (unsigned number = 1; number <= hosts; ++number) {
      if (each["host"] != instance_of(number)) continue;
      Told& told = report.hosts[number - 1];
      const std::string outcome = each["outcome"];
      // Two lives of a link: what one of them did counts.
      if (outcome == "switched") {
        told.outcome = Told::Outcome::switched;
      } else if (outcome == "unknown" && told.outcome != Told::Outcome::switched) {
        told.outcome = Told::Outcome::unknown;
      } else if (told.outcome == Told::Outcome::none) {
        told.outcome = Told::Outcome::not_switched;
      }
      told.has_prepared = told.has_prepared || each["prepared"].get<bool>();
      told.generation = std::max(told.generation, each["generation"].get<std::uint64_t>());
    }
  }
  return report;
}

// Whether this attempt may have put the model in force there and then.
bool explains(const Report& report, unsigned number, const ModelInForce& change,
              const History& history) {
  const Span& span = report.tried->span;
  if (change.name != kModels[report.tried->model] || change.time < span.from) return false;
  switch (report.hosts[number - 1].outcome) {
    case Told::Outcome::switched:
      return change.time <= span.to;
    case Told::Outcome::unknown: {
      const bool is_held_up = !history.is_quiet(number, number, span, History::Of::processes);
      return is_held_up || change.time <= span.to + kAnswerOfDaemon;
    }
    default:
      return false;
  }
}

std::string text_of(const SwitchTried& tried) {
  return std::string("switch --all to ") + kModels[tried.model] + " at " + instance_of(tried.host) +
         ", " + std::to_string(tried.span.from / kMs) + " to " +
         std::to_string(tried.span.to / kMs) + " ms";
}

// Nothing but a start of the daemon and these attempts.
void check_changes(const HostEvidence& host, unsigned number, const std::vector<Report>& reports,
                   const History& history, Findings& found, Checked& checked) {
  for (const ModelInForce& change : host.models) {
    if (change.how == "start") continue;
    const bool is_told = std::any_of(reports.begin(), reports.end(), [&](const Report& report) {
      return explains(report, number, change, history);
    });
    checked.switched += is_told ? 1 : 0;
    if (is_told) continue;
    found.push_back(host.name + ": model " + std::to_string(change.generation) + ", \"" +
                    change.name + "\" (" + change.how + "), came into force at " +
                    std::to_string(change.time / kMs) +
                    " ms, though no operator was told that it would");
  }
}

// What was told is so.
void check_report(const Report& report, const std::vector<HostEvidence>& hosts,
                  const History& history, Findings& found, Checked& checked) {
  const SwitchTried& tried = *report.tried;
  const bool has_switched = report.has(Told::Outcome::switched);
  if (!report.is_committed) {
    ++checked.refused;
    if (has_switched) found.push_back(text_of(tried) + ": not committed, but switched");
    return;
  }
  const bool is_partly =
      report.has(Told::Outcome::unknown) || report.has(Told::Outcome::not_switched);
  checked.partly += is_partly ? 1 : 0;
  for (unsigned number = 1; number <= hosts.size(); ++number) {
    const Told& told = report.hosts[number - 1];
    if (told.outcome != Told::Outcome::switched) continue;
    if (!told.has_prepared) {
      found.push_back(text_of(tried) + ": " + instance_of(number) +
                      " has switched without a promise");
    }
    const auto& models = hosts[number - 1].models;
    // One that was in force already stays. One that another operator replaced at once, the recorder
    // may not have seen.
    const bool is_so = std::any_of(models.begin(), models.end(), [&](const ModelInForce& each) {
      const bool is_it = each.name == kModels[tried.model] && each.generation == told.generation;
      const bool is_next = each.generation == told.generation + 1 && each.time >= tried.span.from;
      return (is_it || is_next) && each.time <= tried.span.to + kReplaced;
    });
    // A recorder learns of it from the daemon, which may have died.
    if (is_so || !history.is_quiet(number, number, {tried.span.from, tried.span.to + kSecond},
                                   History::Of::processes)) {
      continue;
    }
    std::string text = text_of(tried) + ": " + instance_of(number) +
                       " was reported to have model " + std::to_string(told.generation) +
                       ", but its recording has";
    for (const ModelInForce& each : models) {
      text += " " + std::to_string(each.generation) + " \"" + each.name + "\" (" + each.how +
              ") at " + std::to_string(each.time / kMs) + " ms,";
    }
    found.push_back(text);
  }
}

}  // namespace

void check_switches(const std::vector<HostEvidence>& hosts, const History& history, Findings& found,
                    Checked& checked) {
  std::vector<Report> reports;
  for (const SwitchTried& each : history.switches) {
    reports.push_back(report_of(each, hosts.size()));
    if (each.exit_code == 2 || each.exit_code > 3) {
      found.push_back(text_of(each) + ": ended with " + std::to_string(each.exit_code));
    }
  }
  for (const Report& each : reports) check_report(each, hosts, history, found, checked);
  for (unsigned number = 1; number <= hosts.size(); ++number) {
    check_changes(hosts[number - 1], number, reports, history, found, checked);
  }
}

}  // namespace arbiter::failures
