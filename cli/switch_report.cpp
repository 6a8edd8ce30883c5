// What has come of a switch of all hosts, for people and for programs.
#include <algorithm>
#include <iostream>

#include <nlohmann/json.hpp>

#include "cli/switch_everywhere.hpp"
#include "rules/text/names.hpp"
#include "watch/span.hpp"
#include "wire/document.hpp"

namespace arbiter::cli {
namespace {

using SwitchOutcome = HostSwitch::Outcome;

const char* name_of(SwitchOutcome outcome) {
  switch (outcome) {
    case SwitchOutcome::kSwitched:
      return "switched";
    case SwitchOutcome::kNotSwitched:
      return "not switched";
    case SwitchOutcome::kUnknown:
      return "unknown";
    case SwitchOutcome::kLeftOut:
      break;
  }
  return "left out";
}

// Why some hosts have not switched, or none has.
void say_what_lacks(const SwitchEverywhere& result, const std::string& model) {
  std::cout << std::flush;
  if (!result.is_committed) {
    const std::string why = result.hosts.empty()      ? "there is none"
                            : result.why_none.empty() ? "all must prepare first"
                                                      : result.why_none;
    std::cerr << "arbiter: no host has switched to \"" + model + "\": " + why + "\n";
  } else if (!result.is_whole()) {
    std::cerr << "arbiter: " << rules::counted(result.count(SwitchOutcome::kNotSwitched), "host")
              << " not switched, " << result.count(SwitchOutcome::kUnknown)
              << " unknown; arbiter hosts shows which model is in force on each, as soon as it is "
                 "heard again: then run arbiter switch \""
              << model << "\" on those that lack it, or switch all again\n";
  }
}

}  // namespace

void write_text(const SwitchEverywhere& result, const std::string& model) {
  std::size_t width = 0;
  for (const HostSwitch& each : result.hosts) width = std::max(width, each.host.size());
  for (const HostSwitch& each : result.hosts) {
    std::cout << each.host << std::string(width - each.host.size() + 2, ' ')
              << (each.had_it() ? "has it already" : name_of(each.outcome));
    if (each.had_it()) {
      std::cout << ": model " << each.generation;
    } else if (each.outcome == SwitchOutcome::kSwitched) {
      if (each.took != 0) std::cout << " after " << watch::span_text(each.took);
      std::cout << ": model " << each.generation;
    }
    if (!each.why.empty()) std::cout << ": " << each.why;
    std::cout << '\n';
  }
  const auto had = static_cast<std::size_t>(std::count_if(
      result.hosts.begin(), result.hosts.end(), [](const auto& each) { return each.had_it(); }));
  const std::size_t switched = result.count(SwitchOutcome::kSwitched) - had;
  if (result.is_committed && (switched != 0 || had == 0)) {
    std::cout << rules::counted(switched, "host") << " switched to \"" << model
              << "\" one by one, within " << watch::span_text(result.interval)
              << " of the first commit\n";
  } else if (result.is_committed) {
    std::cout << "\"" << model << "\" was in force already, so nothing has changed\n";
  }
  say_what_lacks(result, model);
}

void write_json(const SwitchEverywhere& result, const std::string& model) {
  auto hosts = nlohmann::json::array();
  for (const HostSwitch& each : result.hosts) {
    hosts.push_back({{"host", each.host},
                     {"incarnation", each.incarnation},
                     {"outcome", name_of(each.outcome)},
                     {"prepared", each.has_prepared},
                     {"already", each.had_it()},
                     {"took", each.took},
                     {"generation", each.generation},
                     {"why", each.why}});
  }
  std::cout << wire::write_document({{"model", model},
                                     {"committed", result.is_committed},
                                     {"ok", result.is_whole()},
                                     {"interval", result.interval},
                                     {"hosts", std::move(hosts)}});
  say_what_lacks(result, model);
}

}  // namespace arbiter::cli
