// arbiter echo: prints what arrives at a port.
#include <memory>
#include <string>

#include <CLI/CLI.hpp>

#include "cli/echo.hpp"
#include "cli/live.hpp"
#include "cli/numbers.hpp"
#include "cli/verbs.hpp"
#include "rules/text/names.hpp"

namespace arbiter::cli {
namespace {

// Before anything is said of a port by that name.
std::string problem_of_name(std::string& port) {
  if (port.empty()) return "the name is empty; echo takes one port";
  const auto problem = rules::find_problem_in_port(port);
  return problem ? problem->message + "; echo takes one port" : "";
}

int echo(const EchoOptions& options) {
  const auto interrupts = catch_interrupts();
  if (options.as_component) return echo_component(options, interrupts);
  return options.rate ? echo_rate(options, interrupts) : echo_tap(options, interrupts);
}

}  // namespace

void add_echo(CLI::App& app, int& exit_code) {
  const auto options = std::make_shared<EchoOptions>();
  CLI::App* verb = app.add_subcommand(
      "echo", "Watch a port, and print what arrives there and what becomes of it");
  verb->add_option("PORT", options->port,
                   "An output port: all its arrivals; an input port: what its arbiter accepts")
      ->required()
      ->check(CLI::Validator(problem_of_name, ""));
  verb->add_option("--count", options->count,
                   "Stop after this many lines; with --rate, after this many seconds' rates")
      ->type_name("N")
      ->check(at_least_one());
  verb->add_option_function<std::string>(
          "--for",
          [options](const std::string& text) {
            options->duration = read_time_above_zero("--for", text);
          },
          "End after this time: 500ms, 10s")
      ->type_name("DURATION");
  auto* losers = verb->add_flag(
      "--losers", options->losers,
      "Of an input port: also what was discarded, refused or not decided, signals and "
      "deactivations, and how many samples were dropped at the take or overtaken in a full queue");
  verb->add_flag("--hex", options->hex, "Print all bytes of each sample");
  auto* rate = verb->add_flag("--rate", options->rate,
                              "Once a second, by source: samples per second, their jitter (the "
                              "standard deviation of the time between two), bytes per second");
  auto* as_component = verb->add_flag(
      "--as-component", options->as_component,
      "Open the input port PORT, which no component may have open, and take from it");
  as_component->excludes(losers)->excludes(rate);
  verb->add_flag("--json", options->json,
                 "One object a line: {port, source, type, kind, sequence, stamp_ns, size, "
                 "generation, fates}; also count, of what was dropped or overtaken; with --hex "
                 "also data; with --rate {port, source, samples, hz, jitter_ns, "
                 "longest_ns, bytes_per_second}; with --as-component {port, source, sequence, "
                 "stamp_ns, size}");
  add_instance_option(*verb, options->instance);
  verb->footer(
      "A port is watched through a tap, which disturbs nobody; the policy must allow you to `tap` "
      "it. If\nno component has it open, `echo` says so, and waits for one.\n\nExample:\n  arbiter "
      "echo /Gaze/pos:i --losers --for 10s");
  verb->callback([options, &exit_code] { exit_code = echo(*options); });
}

}  // namespace arbiter::cli
