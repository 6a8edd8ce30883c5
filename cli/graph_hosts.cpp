#include "cli/graph_hosts.hpp"

#include <algorithm>
#include <chrono>
#include <iostream>
#include <stdexcept>
#include <utility>
#include <vector>

#include "cli/live.hpp"
#include "cli/other_hosts.hpp"
#include "rules/ask/host_places.hpp"
#include "rules/model/application_reader.hpp"
#include "rules/text/text_file.hpp"
#include "shm/clock.hpp"
#include "shm/utf8.hpp"
#include "wire/document.hpp"
#include "wire/link_call.hpp"
#include "wire/status.hpp"

namespace arbiter::cli {
namespace {

using drawing::Places;
using drawing::Situation;

constexpr std::chrono::seconds kAskPeriod{1};
// More than a link waits for other hosts.
constexpr std::chrono::milliseconds kLinkPatience{2000};

Places places_in(const rules::Application& application, const std::string& file,
                 const rules::RuleSet& rules, rules::Diagnostics& diagnostics) {
  const rules::SourceUses uses = rules::uses_of_sources(rules);
  const rules::HostPlaces found(rules, uses, application, file, diagnostics);
  Places places;
  const auto place = [&](std::map<std::string, std::string>& of, const std::string& name,
                         const std::string& host) {
    if (host.empty()) return;
    of[name] = host;
    places.boxes.try_emplace(host);
  };
  for (const auto& [source, use] : uses) {
    const std::vector<std::string>& hosts = found.of_source(source);
    if (hosts.empty()) continue;
    place(places.sources, source, hosts.front());
    if (hosts.size() == 1) continue;
    std::string others;
    for (std::size_t i = 1; i < hosts.size(); ++i) others += (i == 1 ? "" : ", ") + hosts[i];
    places.notes[source] = "also on " + others;
  }
  const auto place_port = [&](const std::string& port) {
    place(places.ports, port, std::string(found.of_port(port)));
  };
  for (const rules::PortRules& each : rules.ports) place_port(each.port);
  for (const rules::Connection& each : rules.other_connections) place_port(each.port);
  return places;
}

Situation situation_of(const wire::Status& status) {
  Situation situation;
  for (const wire::SourceStatus& each : status.sources) {
    if (each.active) situation.active.insert(each.name);
  }
  for (const wire::InputStatus& each : status.inputs) {
    if (each.winner) situation.winners[each.name] = *each.winner;
  }
  return situation;
}

// What others say of themselves may be anything.
void look_at(const wire::HostAnswer& answer, SeenHosts& seen) {
  std::string why_not = answer.why_not();
  if (why_not.empty()) {
    try {
      seen.elsewhere[answer.host] = situation_of(read_status_of_host(answer.text));
      return;
    } catch (const wire::DocumentError& error) {
      why_not = std::string("sent no status that can be read: ") + error.what();
    }
  }
  seen.why_not.try_emplace(answer.host, shm::printable(why_not));
}

std::vector<std::string> captions_of(const SeenHosts& seen, const wire::HostStatus& host) {
  std::vector<std::string> captions;
  if (!host.is_up) {
    captions.push_back("gone for " + seconds_text(seen.time - host.since));
    return captions;
  }
  captions.push_back(
      (host.is_this ? "this host" : "round trip " + round_trip_text(host.round_trip)) + ", " +
      model_text(host, seen.hosts.find_this()));
  const auto why_not = seen.why_not.find(host.host);
  if (why_not != seen.why_not.end() && !host.is_this) captions.push_back(why_not->second);
  return captions;
}

}  // namespace

Places places_by(const std::string& file, const rules::RuleSet& rules,
                 rules::Diagnostics& diagnostics) {
  const rules::TextFile text(file, rules::read_bytes(file));
  const rules::Application application = rules::read_application(text, diagnostics);
  return diagnostics.has_errors() ? Places{} : places_in(application, file, rules, diagnostics);
}

std::optional<Places> places_by(const SeenHosts& seen, const Situation& here) {
  if (seen.hosts.hosts.size() < 2) return std::nullopt;
  Places places;
  // Those that are there come first: what was elsewhere once may be there now.
  for (const wire::HostStatus& host : seen.hosts.hosts) {
    Places::Box& box = places.boxes[host.host];
    if (box.captions.empty()) {
      box.captions = captions_of(seen, host);
      const auto there = seen.elsewhere.find(host.host);
      if (host.is_this) {
        box.situation = &here;
      } else if (host.is_up && there != seen.elsewhere.end()) {
        box.situation = &there->second;
      }
    }
    for (const std::string& each : host.inputs) places.ports.try_emplace(each, host.host);
    for (const std::string& each : host.outputs) places.sources.try_emplace(each, host.host);
  }
  // Of several that have a source open, the one that is obeyed here.
  for (const wire::ImportStatus& each : seen.hosts.imports) {
    if (each.is_open) places.sources[each.source] = each.host;
  }
  return places;
}

std::shared_ptr<const SeenHosts> HostsInquirer::ask() {
  std::shared_ptr<SeenHosts> seen;
  std::string problem;
  try {
    wire::LinkCall link(instance_, kLinkPatience);
    auto now = std::make_shared<SeenHosts>();
    now->hosts = wire::read_hosts(link.ask({"", "hosts"}));
    now->time = shm::monotonic_now();
    if (now->hosts.hosts.size() > 1) {
      const wire::HostStatus* const here = now->hosts.find_this();
      for (const wire::HostAnswer& each : link.ask_hosts({wire::kAllHosts, "status"})) {
        const bool is_here = here != nullptr && here->incarnation == each.incarnation;
        if (!is_here) look_at(each, *now);
      }
    }
    seen = std::move(now);
  } catch (const wire::NoLinkError&) {
  } catch (const std::runtime_error& error) {
    problem = error.what();
  }
  if (problem != said_ && !problem.empty()) {
    std::cerr << "arbiter: nothing is known of other hosts: " << problem << '\n';
  }
  said_ = problem;
  const std::lock_guard lock(mutex_);
  return last_ = std::move(seen);
}

void HostsInquirer::begin() {
  thread_ = std::jthread([this](const std::stop_token& stop) { run(stop); });
}

std::shared_ptr<const SeenHosts> HostsInquirer::last() const {
  const std::lock_guard lock(mutex_);
  return last_;
}

void HostsInquirer::run(const std::stop_token& stop) {
  while (!stop.stop_requested()) {
    static_cast<void>(ask());
    std::unique_lock lock(mutex_);
    changed_.wait_for(lock, stop, kAskPeriod, [] { return false; });
  }
}

}  // namespace arbiter::cli
