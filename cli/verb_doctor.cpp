// arbiter doctor: what is wrong around an instance, why it matters, and what to type to mend it.
#include <algorithm>
#include <filesystem>
#include <iostream>
#include <iterator>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include <CLI/CLI.hpp>
#include <nlohmann/json.hpp>

#include "cli/answer.hpp"
#include "cli/live.hpp"
#include "cli/progress.hpp"
#include "cli/verbs.hpp"
#include "rules/text/names.hpp"
#include "shm/utf8.hpp"
#include "watch/doctor.hpp"

namespace arbiter::cli {
namespace {

using nlohmann::json;
using watch::Findings;

struct DoctorOptions {
  std::string instance;
  std::string root;
  std::vector<std::string> silenced;  // codes
  bool json = false;
};

std::string problem_of_finding(std::string& code) {
  const auto& codes = watch::finding_codes();
  if (std::find(codes.begin(), codes.end(), code) != codes.end()) return "";
  return "no finding has the code " + rules::quote(code) +
         "; these are all: " + rules::comma_list(codes);
}

std::string problem_of_root(std::string& root) {
  std::error_code error;
  if (std::filesystem::is_directory(root, error)) return "";
  return rules::quote(root) + " is not a directory";
}

// Names come from processes and files of others.
void write_findings(const Findings& findings, std::size_t silenced) {
  for (const auto& finding : findings) {
    std::cout << shm::printable(finding.what) << "  [" << finding.code
              << "]\n  why:  " << shm::printable(finding.why)
              << "\n  mend: " << shm::printable(finding.mend) << '\n';
  }
  if (findings.empty()) {
    std::cout << "nothing found";
  } else {
    std::cout << findings.size() << (findings.size() == 1 ? " finding" : " findings");
  }
  if (silenced > 0) std::cout << "; silenced: " << silenced;
  std::cout << '\n';
}

void write_json(const std::string& instance, const Findings& findings) {
  json list = json::array();
  for (const auto& finding : findings) {
    list.push_back({{"code", finding.code},
                    {"what", finding.what},
                    {"why", finding.why},
                    {"mend", finding.mend}});
  }
  const json answer{{"instance", instance}, {"findings", std::move(list)}};
  std::cout << answer.dump(2, ' ', false, json::error_handler_t::replace) << '\n';
}

int examine(const DoctorOptions& options) {
  const watch::Machine machine(options.root);
  wire::Caller who = caller("doctor", options.instance);
  std::optional<wire::Status> status;
  Findings findings = watch::examine_machine(machine);
  const auto add = [&](Findings more) {
    std::move(more.begin(), more.end(), std::back_inserter(findings));
  };
  add(watch::examine_meeting_places());
  add(watch::examine_daemon(who, status));
  if (status) {
    add(watch::examine_processes(machine, *status));
    if (options.root.empty()) {
      add(watch::examine_model(*status));
      add(watch::examine_deaths(*status));
      add(watch::examine_ports(*status));
    }
    ProgressLine line;
    add(watch::examine_publishers(who, *status, [&line] {
      line.show([] { return "watching how often sources arrive, for 2.5 s at most"; });
    }));
  }
  add(watch::examine_link(who.instance));
  const std::size_t before = findings.size();
  const auto& silenced = options.silenced;
  std::erase_if(findings, [&](const watch::Finding& finding) {
    return std::find(silenced.begin(), silenced.end(), finding.code) != silenced.end();
  });
  if (options.json) {
    write_json(who.instance, findings);
  } else {
    write_findings(findings, before - findings.size());
  }
  return findings.empty() ? 0 : 1;
}

}  // namespace

void add_doctor(CLI::App& app, int& exit_code) {
  const auto options = std::make_shared<DoctorOptions>();
  CLI::App* verb = app.add_subcommand(
      "doctor",
      "Look for what is wrong with machine, daemon and processes, and say how to mend it");
  verb->add_option("--silence", options->silenced, "Do not report findings with this code")
      ->type_name("CODE")
      ->delimiter(',')
      ->allow_extra_args(false)
      ->check(CLI::Validator(problem_of_finding, ""));
  verb->add_option("--root", options->root,
                   "Read /proc and /sys below this directory, such as a copy of another machine's")
      ->type_name("DIRECTORY")
      ->check(CLI::Validator(problem_of_root, ""));
  verb->add_flag("--json", options->json, "Write the findings as JSON");
  add_instance_option(*verb, options->instance);
  verb->footer(R"(Examples:
  arbiter doctor
  arbiter doctor --silence governor,realtime-priority

It changes nothing. It asks the daemon for its status once and, where it runs, arbiter-link
for what hosts do not agree upon. Where components have sources open, it watches their
arrivals for 2.5 s at most. It reports the limits of the shell that starts it: run it as the
same user, and in the same place, as your components.

Exit codes: 0 nothing found; 1 findings; 2 wrong use, or it cannot look, or standard output cannot be
written)");
  verb->callback(
      [options, &exit_code] { exit_code = or_cannot_tell([&] { return examine(*options); }); });
}

}  // namespace arbiter::cli
