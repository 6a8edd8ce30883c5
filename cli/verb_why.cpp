// arbiter why: who wins at a port and since when, and what keeps each other connection out.
//
// The daemon only hands out the texts of the model in force. What is active is read where the
// decisions read it, in the activity pages, and explained here.
#include <iostream>
#include <memory>
#include <string>

#include <CLI/CLI.hpp>

#include "cli/live.hpp"
#include "cli/numbers.hpp"
#include "cli/other_hosts.hpp"
#include "cli/port_name.hpp"
#include "cli/verbs.hpp"
#include "cli/why_answer.hpp"
#include "cli/why_elsewhere.hpp"
#include "cli/why_follow.hpp"

namespace arbiter::cli {
namespace {

int why(const WhyOptions& options) {
  const auto hosts = hosts_if_linked(options.instance);
  if (hosts) require_one_host(options.host, *hosts);
  const wire::HostStatus* const here = hosts ? hosts->find_this() : nullptr;
  const bool is_here = here != nullptr && here->host == options.host;
  std::optional<std::string> elsewhere;
  if (!options.host.empty() && !is_here) elsewhere = options.host;
  if (options.host.empty() && hosts) elsewhere = host_that_decides(options.port, *hosts);
  if (options.follow) {
    return elsewhere ? follow_elsewhere(options, *elsewhere) : follow_winners(options);
  }
  if (elsewhere) {
    write_why_elsewhere(std::cout, options, *elsewhere);
    return 0;
  }
  const auto instance = watch_instance("why", options.instance);
  write_why(std::cout, options, instance, nullptr, hosts ? &*hosts : nullptr);
  return 0;
}

}  // namespace

void add_why(CLI::App& app, int& exit_code) {
  const auto options = std::make_shared<WhyOptions>();
  CLI::App* verb = app.add_subcommand(
      "why", "Show who wins at an input port, since when, and what keeps the others out");
  verb->add_option("PORT", options->port, "An input port's name")
      ->required()
      ->check(name_of_port());
  auto* source =
      verb->add_option("SOURCE", options->source, "An output port's name: show its connection only")
          ->check(name_of_port());
  auto* follow = verb->add_flag("--follow", options->follow,
                                "Print each change of the winner, and its cause, as it comes; of "
                                "a port of another host, what has changed every half second");
  source->excludes(follow);
  verb->add_option("--count", options->count, "With --follow: stop after this many changes")
      ->type_name("N")
      ->needs(follow)
      ->check(at_least_one());
  verb->add_flag("--all", options->all,
                 "Show everything about every connection; otherwise the answer fits a screen")
      ->excludes(follow);
  verb->add_flag("--json", options->json, "As JSON; with --follow one object a line");
  verb->add_option("--host", options->host,
                   "Ask that host, by arbiter-link; by default the one that has the port open")
      ->type_name("NAME");
  add_instance_option(*verb, options->instance);
  verb->footer(
      "Example:\n"
      "  arbiter why /Gaze/pos:i\n"
      "  arbiter why /Gaze/pos:i /Face/pos:o\n"
      "  arbiter why /Gaze/pos:i --follow\n"
      "  arbiter why /Gaze/pos:i --host head\n"
      "  arbiter why /Gaze/pos:i --host head --follow\n\n"
      "Of a recording: arbiter simulate --recording FILE --why=PORT --at TIME\n\n"
      "Exit codes: 0 answered, whoever wins; 1 no daemon, no such port or source, you may not\n"
      "observe, or the other host does not answer; 2 wrong use, or the answer cannot be written");
  verb->callback([options, &exit_code] { exit_code = why(*options); });
}

}  // namespace arbiter::cli
