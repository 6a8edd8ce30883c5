// arbiter replay: publishes a recording into a running instance.
#include <algorithm>
#include <iostream>
#include <memory>
#include <set>
#include <string>
#include <variant>
#include <vector>

#include <CLI/CLI.hpp>

#include "cli/live.hpp"
#include "cli/numbers.hpp"
#include "cli/progress.hpp"
#include "cli/recording_part.hpp"
#include "cli/simulate_recording.hpp"
#include "cli/verbs.hpp"
#include "command_line/shell_word.hpp"
#include "evidence/record_reader.hpp"
#include "recorder/replayer.hpp"
#include "rules/model/quantifiers.hpp"
#include "rules/text/names.hpp"
#include "shm/utf8.hpp"

namespace arbiter::cli {
namespace {

struct ReplayVerb {
  std::string file;
  double speed = 1;
  bool is_fast = false;
  std::vector<std::string> sources;
  std::vector<std::string> ports;
  PartOptions part;
  std::string instance;
};

using Names = std::set<std::string>;

// Of which anything arrived, or that were deactivated.
Names sources_in(const std::string& file) {
  Names names;
  evidence::read_recording(file, evidence::Payloads::pass_over, [&](evidence::Record&& record) {
    const bool is_event = std::holds_alternative<evidence::Arrival>(record) ||
                          std::holds_alternative<evidence::Deactivation>(record);
    if (is_event) names.insert(evidence::context_of(record)->source);
  });
  return names;
}

bool fits_any(const std::vector<std::string>& patterns, const Names& names) {
  return std::any_of(names.begin(), names.end(), [&](const std::string& name) {
    return std::any_of(patterns.begin(), patterns.end(),
                       [&](const std::string& pattern) { return rules::matches(pattern, name); });
  });
}

// Throws what says why there is nothing to publish.
[[noreturn]] void say_what_it_has(const ReplayVerb& verb, const std::string& what) {
  const Names names = sources_in(verb.file);
  if (names.empty()) {
    throw recorder::ReplayError(verb.file + ": nothing arrived while it was recorded");
  }
  const std::string has = "; it has " + rules::enumerate({names.begin(), names.end()});
  if (!verb.sources.empty() && !fits_any(verb.sources, names)) {
    std::string text;
    for (const std::string& pattern : verb.sources) {
      text += (text.empty() ? "--source " : ", ") + command_line::shell_word(pattern);
    }
    throw CLI::ValidationError(text + " matches no source in " + verb.file + has);
  }
  throw recorder::ReplayError(what + has);
}

// Opens the ports.
std::unique_ptr<recorder::Replayer> replayer_for(const ReplayVerb& verb,
                                                 const recorder::ReplayOptions& options,
                                                 ProgressLine& line) {
  try {
    return std::make_unique<recorder::Replayer>(options);
  } catch (const recorder::NothingChosen& error) {
    line.clear();
    say_what_it_has(verb, error.what());
  }
}

int replay(const ReplayVerb& verb) {
  const auto interrupts = catch_interrupts();
  recorder::ReplayOptions options;
  options.file = verb.file;
  options.node = live_options(verb.instance);
  options.speed = verb.is_fast ? 0 : verb.speed;
  options.sources = verb.sources;
  options.ports = verb.ports;
  options.part = part_of(verb.file, verb.part);
  ProgressLine line;
  options.watch = line.watch("looking for what the recording has");
  options.say = [&line](const std::string& text) {
    line.clear();
    std::cerr << "arbiter: " + shm::printable(text) + '\n';
  };
  const auto replayer = replayer_for(verb, options, line);
  line.clear();
  const auto replayed = replayer->run(interrupts);
  if (replayed.was_interrupted) std::cout << "stopped before the end: ";
  std::cout << rules::counted(replayed.samples, "sample") << ", "
            << rules::counted(replayed.signals, "signal") << " and "
            << rules::counted(replayed.deactivations, "deactivation") << " of "
            << rules::counted(replayed.sources, "source") << " in " << seconds_text(replayed.time)
            << '\n';
  if (replayed.at_start != 0) {
    std::cout << "and first " << rules::counted(replayed.at_start, "signal")
              << ", for who was active as it begins\n";
  }
  if (replayed.without_payload != 0) {
    std::cout << rules::counted(replayed.without_payload, "sample")
              << " whose payload is not in the recording became signals\n";
  }
  if (replayed.of_another_type != 0) {
    const auto& changed = replayed.changed;
    std::cout << rules::counted(replayed.of_another_type, "sample")
              << " of another type than the last of "
              << rules::enumerate({changed.begin(), changed.end()}) << " became signals\n";
  }
  if (replayed.samples != 0 && replayed.delivered == 0) {
    std::cout << "none was delivered: "
              << (replayed.refused != 0     ? "input ports refused them; arbiter status says why"
                  : replayed.discarded != 0 ? "they won at no input port; arbiter why says why"
                                            : "no input port that they are connected to is open")
              << '\n';
  }
  return replayed.was_interrupted ? interrupted_exit_code(interrupts) : 0;
}

}  // namespace

void add_replay(CLI::App& app, int& exit_code) {
  const auto options = std::make_shared<ReplayVerb>();
  CLI::App* verb = app.add_subcommand("replay", "Publish a recording into a running instance");
  verb->add_option("FILE", options->file, "A recording with payloads")->required();
  auto* fast = verb->add_flag("--as-fast-as-possible", options->is_fast,
                              "Without waiting; arrivals bear the times of now");
  auto* speed =
      verb->add_option("--speed", options->speed,
                       "How many times faster than it was recorded (default 1); T stays what it is")
          ->type_name("X")
          ->check(number_between(1e-3, 1e6))
          ->excludes(fast);
  verb->add_option("--rate", options->speed, "--speed, as it was called before")
      ->check(number_between(1e-3, 1e6))
      ->excludes(fast)
      ->excludes(speed)
      ->group("");
  verb->add_option("--source", options->sources,
                   "Only output ports of this pattern, such as '/Arm/*'; repeatable")
      ->type_name("PATTERN")
      ->allow_extra_args(false);  // what follows may be FILE
  verb->add_option("--port", options->ports,
                   "Only sources that input ports of this pattern are connected to, or read; "
                   "repeatable")
      ->type_name("PATTERN")
      ->allow_extra_args(false);
  add_part_options(*verb, options->part);
  add_instance_option(*verb, options->instance);
  verb->footer(
      "Example:\n"
      "  arbiter replay incident.mcap --instance desk\n"
      "  arbiter replay night.mcap --from 03:10:00 --to 03:20:00\n"
      "  arbiter replay incident.mcap --port /Arm/pos:i --speed 2\n\n"
      "The ports must be free: stop their components, or use an instance of its own.\n\n"
      "Exit codes: 0 all published; 1 no daemon, or the ports cannot be opened; 2 wrong use, or a "
      "file that\ncannot be read; 130 stopped by Ctrl-C before the end (143 by SIGTERM)");
  verb->callback([options, &exit_code] { exit_code = replay(*options); });
}

}  // namespace arbiter::cli
