// arbiter status: ports, connections, who is active, who wins, and the counters; of this host, or
// of all that links join.
#include <algorithm>
#include <iostream>
#include <memory>
#include <stdexcept>
#include <string>
#include <vector>

#include <CLI/CLI.hpp>
#include <nlohmann/json.hpp>

#include "cli/live.hpp"
#include "cli/other_hosts.hpp"
#include "cli/status_text.hpp"
#include "cli/verbs.hpp"
#include "shm/utf8.hpp"
#include "wire/document.hpp"
#include "wire/link_call.hpp"
#include "wire/status.hpp"

namespace arbiter::cli {
namespace {

struct StatusOptions {
  std::string instance;
  bool json = false;
  bool all = false;
};

int status_here(const StatusOptions& options) {
  const std::string text = fetch_status_text("status", options.instance);
  if (options.json) {
    // As the daemon has it: a newer one may say more than this program knows.
    std::cout << wire::write_document(wire::parse_document(text));
    return 0;
  }
  write_status(std::cout, wire::read_status(text), StatusPlace::kHere);
  write_port_errors(std::cout, hosts_if_linked(options.instance));
  return 0;
}

// By incarnation: several machines may have one name.
const wire::HostStatus* find_host(const wire::HostsDocument& hosts,
                                  const wire::HostAnswer& answer) {
  const auto found = std::find_if(
      hosts.hosts.begin(), hosts.hosts.end(),
      [&](const wire::HostStatus& each) { return each.incarnation == answer.incarnation; });
  return found == hosts.hosts.end() ? nullptr : &*found;
}

// What this host has of others. Without ages, where they cannot be seen.
void write_imports_here(const std::string& instance, const wire::Status& here,
                        const wire::HostsDocument& hosts) {
  std::vector<std::string> sources;
  for (const wire::ImportStatus& each : hosts.imports) {
    if (each.is_open || each.is_gone()) sources.push_back(each.source);
  }
  if (sources.empty()) return;
  Ages ages;
  try {
    ages = ages_in(*watch_instance("status", instance));
  } catch (const std::runtime_error&) {  // the daemon has just gone, or has no room for us
  }
  write_imports(std::cout, sources, here, hosts, ages);
}

// Writes one host's answer; what is wrong with it stands in `why_not`.
void write_host(const StatusOptions& options, const wire::HostsDocument& hosts,
                const wire::HostAnswer& answer, std::string& why_not) {
  const wire::HostStatus* const host = find_host(hosts, answer);
  const bool is_here = host != nullptr && host->is_this;
  try {
    const wire::Status status = read_status_of_host(answer.text);
    const std::string where =
        is_here ? "this one"
                : "round trip " + round_trip_text(host ? host->round_trip : std::nullopt);
    std::cout << "== host " << answer.host << " (" << where << ") ==\n";
    write_status(std::cout, status, is_here ? StatusPlace::kHere : StatusPlace::kElsewhere);
    if (is_here) write_imports_here(options.instance, status, hosts);
    std::cout << '\n';
  } catch (const wire::DocumentError& error) {
    why_not = std::string("sent no status that can be read: ") + error.what();
  }
}

nlohmann::json json_of(const wire::HostsDocument& hosts, const wire::HostAnswer& answer,
                       std::string& why_not) {
  nlohmann::json host = {{"host", answer.host},
                         {"outcome", wire::outcome_name(answer.outcome)},
                         {"took_ns", answer.took},
                         {"round_trip_ns", nullptr},
                         {"status", nullptr}};
  const wire::HostStatus* const known = find_host(hosts, answer);
  if (known != nullptr && known->round_trip) host["round_trip_ns"] = *known->round_trip;
  if (answer.outcome == wire::HostOutcome::kAnswered) {
    try {
      host["status"] = wire::parse_document(answer.text);
    } catch (const wire::DocumentError& error) {
      why_not = error.what();
    }
  }
  host["why_not"] = why_not.empty() ? nlohmann::json(nullptr) : nlohmann::json(why_not);
  return host;
}

int status_of_all(const StatusOptions& options) {
  wire::LinkCall link(options.instance);
  const wire::HostsDocument hosts = wire::read_hosts(link.ask({"", "hosts"}));
  nlohmann::json all = nlohmann::json::array();
  int exit_code = 0;
  if (!hosts.network) {
    exit_code = 1;
    std::cerr << "arbiter: the link has not joined its network yet, and does not know the other "
                 "hosts"
              << (hosts.waits_for ? ": " + shm::printable(*hosts.waits_for) : "") << '\n';
  }
  for (const wire::HostAnswer& answer : link.ask_hosts({wire::kAllHosts, "status"})) {
    std::string why_not = answer.why_not();
    if (options.json) {
      all.push_back(json_of(hosts, answer, why_not));
    } else if (why_not.empty()) {
      write_host(options, hosts, answer, why_not);
    }
    if (why_not.empty()) continue;
    exit_code = 1;
    std::cerr << "arbiter: host " << answer.host << ' ' << shm::printable(why_not) << '\n';
  }
  if (options.json) {
    std::cout << wire::write_document({{"hosts", all}});
  } else {
    write_port_errors(std::cout, hosts);
  }
  return exit_code;
}

}  // namespace

void add_status(CLI::App& app, int& exit_code) {
  const auto options = std::make_shared<StatusOptions>();
  CLI::App* verb = app.add_subcommand("status", "Show ports, connections, winners and counters");
  verb->add_flag("--all", options->all, "Of all hosts that arbiter-link knows, one after another");
  verb->add_flag(
      "--json", options->json,
      "Write the daemon's JSON document; with --all an object that has one for each host");
  add_instance_option(*verb, options->instance);
  verb->footer(
      "Example:\n"
      "  arbiter status\n"
      "  arbiter status --all\n\n"
      "Exit codes: 0 shown; 1 no daemon, or you may not observe; with --all: no link, one that "
      "has\n"
      "not joined its network, or a host is silent, gone, or refuses; 2 wrong use, or the answer "
      "cannot be written");
  verb->callback([options, &exit_code] {
    exit_code = options->all ? status_of_all(*options) : status_here(*options);
  });
}

}  // namespace arbiter::cli
