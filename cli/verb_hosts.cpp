// arbiter hosts: the hosts that arbiter-link knows, and what they do not agree upon.
#include <algorithm>
#include <array>
#include <iostream>
#include <memory>
#include <sstream>
#include <string>
#include <vector>

#include <CLI/CLI.hpp>
#include <nlohmann/json.hpp>

#include "cli/live.hpp"
#include "cli/other_hosts.hpp"
#include "cli/verbs.hpp"
#include "shm/clock.hpp"
#include "shm/utf8.hpp"
#include "wire/document.hpp"
#include "wire/link_call.hpp"

namespace arbiter::cli {
namespace {

struct HostsOptions {
  std::string instance;
  bool json = false;
};

// What the others said is theirs.
std::string shown(const std::string& text) { return shm::printable(text); }

std::string link_text(const wire::HostStatus& host) {
  return (host.is_up ? "up " : "gone ") + seconds_text(shm::monotonic_now() - host.since) +
         (host.is_deaf ? ", deaf" : "");
}

using Row = std::array<std::string, 7>;

Row row_of(const wire::HostsDocument& document, const wire::HostStatus& host) {
  const auto from_there = std::count_if(
      document.imports.begin(), document.imports.end(),
      [&](const wire::ImportStatus& each) { return each.is_open && each.host == host.host; });
  return {(host.is_this ? "* " : "  ") + shown(host.host),
          link_text(host),
          round_trip_text(host.round_trip),
          model_text(host, document.find_this()),
          std::to_string(host.output_count),
          std::to_string(host.imports),
          host.is_this ? "-" : std::to_string(from_there)};
}

void write_table(const std::vector<Row>& rows) {
  std::array<std::size_t, std::tuple_size_v<Row>> widths{};
  for (const Row& row : rows) {
    for (std::size_t i = 0; i < row.size(); ++i) widths[i] = std::max(widths[i], row[i].size());
  }
  for (const Row& row : rows) {
    std::string line;
    for (std::size_t i = 0; i < row.size(); ++i) {
      line += row[i] + std::string(widths[i] - row[i].size() + 2, ' ');
    }
    std::cout << line.substr(0, line.find_last_not_of(' ') + 1) << '\n';
  }
}

void write_wanted_sources(const wire::HostsDocument& document) {
  if (document.imports.empty()) return;
  std::cout << "\nsources of other hosts that the model here wants\n";
  for (const wire::ImportStatus& each : document.imports) {
    std::cout << "  " << shown(each.source);
    if (each.is_open) {
      std::cout << "  from host " << shown(each.host);
    } else {
      std::cout << (each.is_open_here ? "  open here" : "  not imported");
      if (each.is_gone()) std::cout << ": it came from host " << shown(each.host);
    }
    std::cout << counts_text(each) << '\n';
  }
}

// Links of several versions may understand each other, and need not.
void write_versions(std::ostream& out, const wire::HostsDocument& document) {
  for (const wire::HostStatus& each : document.hosts) {
    if (!each.is_up || each.version == document.version) continue;
    out << "warning: the link of host " << shown(each.host) << " is version " << shown(each.version)
        << ", and this one is " << shown(document.version)
        << ": install the same version on all hosts\n";
  }
}

// The rest looks as if all were well: it is there, and names what it has open.
void write_deaf(std::ostream& out, const wire::HostsDocument& document) {
  for (const wire::HostStatus& each : document.hosts) {
    if (!each.is_deaf) continue;
    out << "warning: host " << shown(each.host)
        << " is there, and has not heard this one for 2 s: nothing is imported from it until it "
           "does; see whether the network carries words both ways\n";
  }
}

std::string warnings_of(const wire::HostsDocument& document) {
  std::ostringstream out;
  if (document.without_place != 0) {
    out << "warning: " << wire::without_place_text(document.without_place) << '\n';
  }
  write_versions(out, document);
  write_deaf(out, document);
  for (const wire::HostDisagreement& each : document.disagreements) {
    out << (each.is_error ? "ERROR: " : "warning: ") << shown(each.text) << '\n';
  }
  return out.str();
}

int hosts(const HostsOptions& options) {
  const std::string text = wire::LinkCall(options.instance).ask({"", "hosts"});
  const wire::HostsDocument document = wire::read_hosts(text);
  const bool has_errors =
      std::any_of(document.disagreements.begin(), document.disagreements.end(),
                  [](const wire::HostDisagreement& each) { return each.is_error; });
  if (options.json) {
    std::cout << wire::write_document(wire::parse_document(text));
    return has_errors ? 1 : 0;
  }
  std::cout << "host " << document.host << ", instance " << document.instance << ", "
            << (document.network ? "on " + *document.network : "not on a network yet") << '\n';
  if (document.waits_for) std::cout << "  waits: " << shown(*document.waits_for) << '\n';
  std::vector<Row> rows{
      {"  host", "link", "round trip", "model", "offers", "imports", "imported by us"}};
  for (const wire::HostStatus& host : document.hosts) rows.push_back(row_of(document, host));
  std::cout << '\n';
  write_table(rows);
  write_wanted_sources(document);
  const std::string warnings = warnings_of(document);
  if (!warnings.empty()) std::cout << '\n' << warnings;
  return has_errors ? 1 : 0;
}

}  // namespace

void add_hosts(CLI::App& app, int& exit_code) {
  const auto options = std::make_shared<HostsOptions>();
  CLI::App* verb = app.add_subcommand(
      "hosts", "Show the hosts that arbiter-link joins, and what they do not agree upon");
  verb->add_flag("--json", options->json, "Write the link's JSON document");
  add_instance_option(*verb, options->instance);
  verb->footer(
      "Example:\n  arbiter hosts\n\n"
      "Exit codes: 0 shown; 1 no link, or you may not observe, or an input port is open on "
      "several\n"
      "hosts; 2 wrong use, or the answer cannot be written");
  verb->callback([options, &exit_code] { exit_code = hosts(*options); });
}

}  // namespace arbiter::cli
