#include "cli/switch_everywhere.hpp"

#include <algorithm>
#include <stdexcept>
#include <string_view>

#include "rules/text/names.hpp"
#include "shm/clock.hpp"
#include "shm/utf8.hpp"

namespace arbiter::cli {
namespace {

using SwitchOutcome = HostSwitch::Outcome;
using wire::HostAnswer;
using wire::HostOutcome;

bool is_left_out(const wire::SwitchRequest& request, const std::string& host) {
  return std::find(request.without.begin(), request.without.end(), host) != request.without.end();
}

// What a host has answered; throws std::runtime_error saying why it has not, or what is wrong.
wire::SwitchAnswer answer_of(const HostAnswer& each) {
  switch (each.outcome) {
    case HostOutcome::kAnswered:
      return wire::read_switch_answer(each.text);
    case HostOutcome::kRefused:
      throw std::runtime_error(each.text);
    case HostOutcome::kSilent:
      throw std::runtime_error("its link did not answer within 1 s");
    case HostOutcome::kGone:
      break;
  }
  throw std::runtime_error("it is gone, and was there within the last five minutes; --without " +
                           each.host + " leaves it out");
}

HostSwitch prepared(const wire::SwitchRequest& request, const HostAnswer& each) {
  HostSwitch host{.host = each.host, .incarnation = each.incarnation, .why = {}};
  if (is_left_out(request, each.host)) {
    host.outcome = SwitchOutcome::kLeftOut;
    return host;
  }
  try {
    const wire::SwitchAnswer answer = answer_of(each);
    host.has_prepared = !answer.is_left_out;
    host.before = answer.generation;
    if (!host.has_prepared) host.why = "it says that it is left out";
  } catch (const std::runtime_error& error) {
    host.why = shm::printable(error.what());
  }
  return host;
}

void note_commit(HostSwitch& host, const HostAnswer& each) {
  host.took = each.took;
  try {
    const wire::SwitchAnswer answer = answer_of(each);
    host.generation = answer.generation;
    host.why = shm::printable(answer.unknown);
    host.outcome = answer.unknown.empty() ? SwitchOutcome::kSwitched : SwitchOutcome::kUnknown;
  } catch (const std::runtime_error& error) {
    // A refusal is the answer of one that has not done it. Whatever else is wrong tells nothing.
    host.outcome = each.outcome == HostOutcome::kRefused ? SwitchOutcome::kNotSwitched
                                                         : SwitchOutcome::kUnknown;
    host.why = shm::printable(error.what());
  }
}

void note_that_none_switches(SwitchEverywhere& result) {
  for (HostSwitch& host : result.hosts) {
    if (host.has_prepared) host.why = "it was prepared, and keeps its model";
  }
}

void commit(const wire::SwitchRequest& request, const AskHosts& ask, SwitchEverywhere& result) {
  std::vector<HostAnswer> answers;
  std::string why_unknown = "it is not there any longer";
  try {
    answers = ask(wire::kCommitVerb, wire::write_switch_request(request));
  } catch (const wire::NotAskedError& error) {
    result.why_none = error.what();
    return note_that_none_switches(result);    // the promises end by themselves
  } catch (const std::runtime_error& error) {  // or its answers cannot be read
    why_unknown = error.what();
  }
  result.is_committed = true;
  for (HostSwitch& host : result.hosts) {
    if (!host.has_prepared) continue;
    host.outcome = SwitchOutcome::kUnknown;
    host.why = why_unknown;
  }
  for (const HostAnswer& each : answers) {
    const auto host =
        std::find_if(result.hosts.begin(), result.hosts.end(), [&](const HostSwitch& known) {
          return known.host == each.host && known.incarnation == each.incarnation;
        });
    if (host == result.hosts.end()) {
      const bool is_out = is_left_out(request, each.host);
      result.hosts.push_back(
          {.host = each.host,
           .incarnation = each.incarnation,
           .outcome = is_out ? SwitchOutcome::kLeftOut : SwitchOutcome::kNotSwitched,
           .why = is_out ? "" : "it has come after the others had prepared"});
    } else if (host->has_prepared) {
      note_commit(*host, each);
      result.interval = std::max(result.interval, each.took);
    }
  }
}

// The one that prepared, or the only one of its name: its link may have begun again. Null: nobody
// can tell which it is.
const wire::HostStatus* find_host(const HostSwitch& host, const wire::HostsDocument& hosts) {
  const wire::HostStatus* found = nullptr;
  int namesakes = 0;
  for (const wire::HostStatus& each : hosts.hosts) {
    if (each.host != host.host || !each.is_up) continue;
    if (each.incarnation == host.incarnation) return &each;
    found = &each;
    ++namesakes;
  }
  return namesakes == 1 ? found : nullptr;
}

// Of a host whose commit is not answered: whether the model has come into force.
void look_at(HostSwitch& host, const wire::HostsDocument& hosts, const std::string& model) {
  const wire::HostStatus* there = find_host(host, hosts);
  if (there == nullptr || !there->has_daemon || !there->model) return;
  // What it said before it prepared may be old. To switch to the model in force changes nothing.
  if (there->model->generation < host.before || there->model->name != model) return;
  host.outcome = SwitchOutcome::kSwitched;
  host.generation = there->model->generation;
  host.took = 0;
  host.why = "it did not answer, and has the model in force";
}

void find_out(const wire::SwitchRequest& request, const LookAtHosts& look, shm::Nanoseconds since,
              SwitchEverywhere& result) {
  for (int i = 0; i < kMostLooks && result.count(SwitchOutcome::kUnknown) != 0; ++i) {
    wire::HostsDocument hosts;
    try {
      hosts = look();
    } catch (const std::runtime_error&) {  // the link joins its network again, or has gone
      continue;
    }
    for (HostSwitch& each : result.hosts) {
      if (each.outcome != SwitchOutcome::kUnknown) continue;
      look_at(each, hosts, request.model);
      if (each.outcome == SwitchOutcome::kSwitched)
        result.interval = std::max(result.interval, shm::monotonic_now() - since);
    }
  }
}

// Whoever misspells it would switch the very host that was to keep its model.
std::string unknown_among_left_out(const wire::SwitchRequest& request,
                                   const std::vector<HostSwitch>& hosts) {
  std::vector<std::string_view> known;
  known.reserve(hosts.size());
  for (const HostSwitch& each : hosts) known.push_back(each.host);
  for (const std::string& host : request.without) {
    if (std::find(known.begin(), known.end(), host) != known.end()) continue;
    return "--without " + shm::printable(host) + ": no host of that name is known" +
           rules::advise(host, known,
                         "arbiter hosts names them; one that is not there needs no leaving out");
  }
  return "";
}

void put_in_order(std::vector<HostSwitch>& hosts) {
  std::stable_sort(hosts.begin(), hosts.end(),
                   [](const HostSwitch& a, const HostSwitch& b) { return a.host < b.host; });
}

}  // namespace

std::size_t SwitchEverywhere::count(SwitchOutcome outcome) const {
  return static_cast<std::size_t>(std::count_if(
      hosts.begin(), hosts.end(), [&](const HostSwitch& each) { return each.outcome == outcome; }));
}

bool SwitchEverywhere::is_whole() const {
  return is_committed && count(SwitchOutcome::kNotSwitched) == 0 &&
         count(SwitchOutcome::kUnknown) == 0;
}

SwitchEverywhere switch_everywhere(const wire::SwitchRequest& request, const AskHosts& ask,
                                   const LookAtHosts& look) {
  SwitchEverywhere result;
  const std::string text = wire::write_switch_request(request);
  for (const HostAnswer& each : ask(wire::kPrepareVerb, text)) {
    result.hosts.push_back(prepared(request, each));
  }
  const bool has_any = std::any_of(result.hosts.begin(), result.hosts.end(),
                                   [](const HostSwitch& each) { return each.has_prepared; });
  const bool have_all =
      std::all_of(result.hosts.begin(), result.hosts.end(), [](const HostSwitch& each) {
        return each.has_prepared || each.outcome == SwitchOutcome::kLeftOut;
      });
  result.why_none = unknown_among_left_out(request, result.hosts);
  if (has_any && have_all && result.why_none.empty()) {
    const shm::Nanoseconds since = shm::monotonic_now();
    commit(request, ask, result);
    find_out(request, look, since, result);
  } else if (has_any) {
    note_that_none_switches(result);
    // Otherwise they would be held for two seconds.
    try {
      static_cast<void>(ask(wire::kReleaseVerb, text));
    } catch (const std::runtime_error&) {
    }
  }
  put_in_order(result.hosts);
  return result;
}

int exit_code_of(const SwitchEverywhere& result) {
  if (result.is_whole()) return 0;
  const bool is_any =
      result.count(SwitchOutcome::kSwitched) + result.count(SwitchOutcome::kUnknown) != 0;
  return result.is_committed && is_any ? 3 : 1;
}

}  // namespace arbiter::cli
