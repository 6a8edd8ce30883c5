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
#include "cli/verbs.hpp"
#include "cli/why_answer.hpp"
#include "cli/why_follow.hpp"

namespace arbiter::cli {
namespace {

int why(const WhyOptions& options) {
  if (options.follow) return follow_winners(options);
  write_why(std::cout, options, watch_instance("why", options.instance));
  return 0;
}

}  // namespace

void add_why(CLI::App& app, int& exit_code) {
  const auto options = std::make_shared<WhyOptions>();
  CLI::App* verb = app.add_subcommand(
      "why", "Show who wins at an input port, since when, and what keeps the others out");
  verb->add_option("PORT", options->port, "An input port's name")->required();
  auto* source = verb->add_option("SOURCE", options->source,
                                  "An output port's name: show its connection only");
  auto* follow = verb->add_flag("--follow", options->follow,
                                "Print each change of the winner, and its cause, as it comes");
  source->excludes(follow);
  verb->add_option("--count", options->count, "With --follow: stop after this many changes")
      ->type_name("N")
      ->needs(follow)
      ->check(at_least_one());
  verb->add_flag("--all", options->all,
                 "Show everything about every connection; otherwise the answer fits a screen")
      ->excludes(follow);
  verb->add_flag("--json", options->json, "As JSON; with --follow one object a line");
  add_instance_option(*verb, options->instance);
  verb->footer(
      "Example:\n"
      "  arbiter why /Gaze/pos:i\n"
      "  arbiter why /Gaze/pos:i /Face/pos:o\n"
      "  arbiter why /Gaze/pos:i --follow\n\n"
      "Exit codes: 0 answered, whoever wins; 1 no daemon, no such port or source, or you may not\n"
      "observe; 2 wrong use, or the answer cannot be written");
  verb->callback([options, &exit_code] { exit_code = why(*options); });
}

}  // namespace arbiter::cli
