// arbiter simulate: what a model would have decided, sample by sample.
#include <unistd.h>

#include <iostream>
#include <memory>
#include <set>
#include <string>
#include <string_view>
#include <vector>

#include <CLI/CLI.hpp>

#include "cli/model_files.hpp"
#include "cli/progress.hpp"
#include "cli/recording_part.hpp"
#include "cli/simulate_recording.hpp"
#include "cli/verbs.hpp"
#include "cli/why_recorded.hpp"
#include "cli/why_simulated.hpp"
#include "rules/ask/report.hpp"
#include "rules/explain/simulation.hpp"
#include "rules/explain/trace.hpp"
#include "rules/text/names.hpp"

namespace arbiter::cli {
namespace {

struct SimulateOptions {
  rules::ModelFiles files;
  std::string trace;
  std::string recording;
  std::string why;  // all_ports, or the port; empty: no
  std::string at;
  PartOptions part;
  double effort = 1;
  bool each = false;
  bool json = false;
};

// What CLI11 takes a flag without a value for; no port is called so.
const std::string all_ports = "true";

// Empty: all.
std::string port_of(const std::string& why) { return why == all_ports ? "" : why; }

// A blank in place of the '=' makes a file of the port.
void require_no_port_among_files(const SimulateOptions& options) {
  for (const std::string& file : options.files.models) {
    if (options.why != all_ports || !file.starts_with('/') || access(file.c_str(), F_OK) == 0) {
      continue;
    }
    std::string message = "there is no file " + file;
    message += "; if it is the port: --why=" + file;
    throw rules::FileError(message);
  }
}

std::string suggestion(const std::string& source, const rules::Simulation& simulation,
                       std::size_t count) {
  if (count > rules::kMaxSuggestions) return "";
  if (simulation.find_port(source)) return "; it is an input port: name who publishes there";
  std::vector<std::string_view> known;
  for (std::size_t i = 0; i < simulation.source_count(); ++i) {
    known.push_back(simulation.source_name(static_cast<shm::SourceId>(i)));
  }
  const auto similar = rules::find_similar(source, known);
  return similar ? "; did you mean " + rules::quote(*similar) + "?" : "";
}

void note_unknown_sources(const rules::Simulation& simulation, const std::string& file,
                          const std::vector<rules::TraceEvent>& events,
                          rules::Diagnostics& diagnostics) {
  std::set<std::string> noted;
  for (const auto& event : events) {
    if (event.kind == rules::TraceKind::kTick || simulation.knows(event.source)) continue;
    if (!noted.insert(event.source).second) continue;
    diagnostics.note("unknown-source", {file, event.line, event.column},
                     "the model does not know " + event.source + "; its arrivals have no effect" +
                         suggestion(event.source, simulation, noted.size()));
  }
}

// Calls use(event) for each; says how far it is where the results do not show it.
template <typename Use>
void replay(const std::vector<rules::TraceEvent>& events, const Use& use) {
  const bool shows_itself = isatty(STDOUT_FILENO) != 0;
  ProgressLine progress;
  for (std::size_t i = 0; i < events.size(); ++i) {
    use(events[i]);
    if (!std::cout) return;  // nobody reads it
    if (shows_itself || i % 256 != 0) continue;
    progress.show([&] {
      return "replaying: " + std::to_string(i) + " of " + std::to_string(events.size()) + " events";
    });
  }
}

void require_model_and_trace(const SimulateOptions& options) {
  if (options.files.models.empty()) throw CLI::RequiredError("MODEL");
  if (options.trace.empty()) throw CLI::RequiredError("--trace");
  if (options.json && options.why.empty()) throw CLI::RequiresError("--json", "--why");
}

// All problems, those of the trace as well as those of the model, come before the first result.
int simulate(const SimulateOptions& options) {
  const bool is_why = !options.why.empty();
  rules::Diagnostics diagnostics;
  const auto keep = is_why ? rules::Keep::kProvenance : rules::Keep::kRules;
  const auto model = load_model(options.files, diagnostics, options.effort, keep);
  const auto events = rules::read_trace(options.trace, diagnostics);
  if (!model || diagnostics.has_errors()) {
    rules::write_text(std::cerr, diagnostics);
    return 1;
  }
  rules::Simulation simulation(model->compiled);
  note_unknown_sources(simulation, options.trace, events, diagnostics);
  rules::write_text(std::cerr, diagnostics);
  if (is_why) {
    WhySimulated why(model->rules, simulation, {port_of(options.why), options.json});
    replay(events, [&](const auto& event) { why.step(event, std::cout); });
    why.tell_repeats(std::cout);
    return 0;
  }
  rules::write_outcome_header(std::cout);
  replay(events, [&](const auto& event) {
    for (const auto& row : simulation.step(event)) rules::write_outcome(std::cout, row);
  });
  return 0;
}

}  // namespace

void add_simulate(CLI::App& app, int& exit_code) {
  const auto options = std::make_shared<SimulateOptions>();
  CLI::App* verb =
      app.add_subcommand("simulate",
                         "Decide a trace or a recording again, and show what would have been "
                         "delivered");
  add_model_options(*verb, options->files).required(false);
  auto* trace = verb->add_option("--trace", options->trace,
                                 "CSV: t_ns,source or t_ns,source,event; -: standard input")
                    ->type_name("FILE")
                    ->transform(dash_for_input());
  auto* recording =
      verb->add_option("--recording", options->recording,
                       "In place of a trace: take each decision of a recording again, and compare "
                       "it with the live one. With a model: what would be different under that")
          ->type_name("FILE")
          ->excludes(trace);
  verb->add_option("--model", options->files.models, "The same as MODEL")
      ->type_name("FILE")
      ->transform(dash_for_input());
  // A flag takes a value only behind '=': what follows it may be the model.
  auto* why = verb->add_flag("--why", options->why,
                             "Instead of the CSV, or of what is compared, show each change of a "
                             "winner and each discarded arrival, with its cause; --why=PORT: for "
                             "this port only");
  auto* at = verb->add_option(
                     "--at", options->at,
                     "With --recording and --why: only at this time of day, and what led to it, in "
                     "your time zone (TZ): 14:03:07 (all of that second), 14:03:07.250, "
                     "'2026-11-22 14:03:07'")
                 ->type_name("TIME")
                 ->needs(recording)
                 ->needs(why);
  for (auto* each : add_part_options(*verb, options->part)) each->needs(recording)->excludes(at);
  add_effort_option(*verb, options->effort);
  verb->add_flag("--each", options->each,
                 "With --recording and a model: a line for each decision that changes, also where "
                 "several of one connection do in a row")
      ->needs(recording)
      ->excludes(why);
  verb->add_flag("--json", options->json,
                 "With --why: one object a line. With --recording alone: one object");
  verb->footer(
      "Example:\n"
      "  arbiter simulate search_and_track.xml --trace trace.csv\n"
      "  arbiter simulate search_and_track.xml --trace trace.csv --why=/Gaze/pos:i\n"
      "  arbiter simulate --recording incident.mcap\n"
      "  arbiter simulate --recording incident.mcap --model corrected.xml\n"
      "  arbiter simulate --recording incident.mcap --why=/Gaze/pos:i\n"
      "  arbiter simulate --recording incident.mcap --why --at 14:03:07\n\n"
      "Exit codes: 0 done; with --recording, unless with --why: all is as it was; 1 an error in "
      "the model or\ntrace; with --recording: something differs, or it has no decision; 2 wrong "
      "use, or a file that\ncannot be opened");
  verb->callback([options, &exit_code] {
    require_no_port_among_files(*options);
    if (!options->recording.empty()) {
      const SimulateRecordingOptions simulated{options->recording, options->files, options->effort,
                                               options->each,      options->json,  options->at,
                                               options->part};
      exit_code = options->why.empty() ? simulate_recording(simulated)
                                       : explain_recording(simulated, port_of(options->why));
      return;
    }
    require_model_and_trace(*options);
    exit_code = simulate(*options);
  });
}

}  // namespace arbiter::cli
