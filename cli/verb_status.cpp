// arbiter status: ports, connections, who is active, who wins, and the counters; of this host, or
// of all that links join.
#include <iostream>
#include <memory>
#include <string>

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

// Writes one host's answer; what is wrong with it stands in `why_not`.
void write_host(const wire::HostAnswer& answer, bool is_here, std::string& why_not) {
  try {
    const wire::Status status = wire::read_status(answer.text);
    std::cout << "== host " << answer.host << (is_here ? " (this one)" : "") << " ==\n";
    write_status(std::cout, status, is_here ? StatusPlace::kHere : StatusPlace::kElsewhere);
    std::cout << '\n';
  } catch (const wire::DocumentError& error) {
    why_not = std::string("sent no status that can be read: ") + error.what();
  }
}

nlohmann::json json_of(const wire::HostAnswer& answer, std::string& why_not) {
  nlohmann::json host = {{"host", answer.host},
                         {"outcome", wire::outcome_name(answer.outcome)},
                         {"took_ns", answer.took},
                         {"status", nullptr}};
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
  const wire::HostStatus* const here = hosts.find_this();
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
    const bool is_here = here != nullptr && answer.incarnation == here->incarnation;
    if (options.json) {
      all.push_back(json_of(answer, why_not));
    } else if (why_not.empty()) {
      write_host(answer, is_here, why_not);
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
