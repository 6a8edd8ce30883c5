// arbiter simulate: what a model would have decided, sample by sample.
#include <iostream>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include <CLI/CLI.hpp>

#include "cli/model_files.hpp"
#include "cli/verbs.hpp"
#include "cli/why_simulated.hpp"
#include "rules/report.hpp"
#include "rules/simulation.hpp"
#include "rules/trace.hpp"

namespace arbiter::cli {
namespace {

struct SimulateOptions {
  rules::ModelFiles files;
  std::string trace;
  std::optional<std::string> why;  // the port; empty: all
  bool json = false;
};

void note_unknown_sources(const rules::Simulation& simulation, const std::string& file,
                          const std::vector<rules::TraceEvent>& events,
                          rules::Diagnostics& diagnostics) {
  std::set<std::string> noted;
  for (const auto& event : events) {
    if (event.kind == rules::TraceKind::kTick || simulation.knows(event.source)) continue;
    if (!noted.insert(event.source).second) continue;
    diagnostics.note("unknown-source", {file, event.line, event.column},
                     "the model does not know " + event.source + "; its arrivals have no effect");
  }
}

// All problems, those of the trace as well as those of the model, come before the first result.
int simulate(const SimulateOptions& options) {
  rules::Diagnostics diagnostics;
  const auto keep = options.why ? rules::Keep::kProvenance : rules::Keep::kRules;
  const auto model = load_model(options.files, diagnostics, keep);
  const auto events = rules::read_trace(options.trace, diagnostics);
  if (!model || diagnostics.has_errors()) {
    rules::write_text(std::cerr, diagnostics);
    return 1;
  }
  rules::Simulation simulation(model->compiled);
  note_unknown_sources(simulation, options.trace, events, diagnostics);
  rules::write_text(std::cerr, diagnostics);
  if (options.why) {
    WhySimulated why(model->rules, simulation, {*options.why, options.json});
    for (const auto& event : events) why.step(event, std::cout);
    return 0;
  }
  rules::write_outcome_header(std::cout);
  for (const auto& event : events) {
    for (const auto& row : simulation.step(event)) rules::write_outcome(std::cout, row);
  }
  return 0;
}

}  // namespace

void add_simulate(CLI::App& app, int& exit_code) {
  const auto options = std::make_shared<SimulateOptions>();
  CLI::App* verb = app.add_subcommand("simulate", "Replay a trace: who would have been heard?");
  add_model_options(*verb, options->files);
  verb->add_option("--trace", options->trace, "CSV: t_ns,source or t_ns,source,event")
      ->type_name("FILE")
      ->required();
  auto* why = verb->add_option_function<std::string>(
                      "--why", [options](const std::string& port) { options->why = port; },
                      "Instead of the CSV: each change of a winner and each arrival that was "
                      "discarded, with its cause; of one PORT or of all")
                  ->type_name("[PORT]")
                  ->expected(0, 1)
                  ->default_str("");
  verb->add_flag("--json", options->json, "With --why: one object a line")->needs(why);
  verb->footer(
      "Example:\n"
      "  arbiter simulate search_and_track.xml --trace trace.csv\n"
      "  arbiter simulate search_and_track.xml --trace trace.csv --why=/Gaze/pos:i");
  verb->callback([options, &exit_code] { exit_code = simulate(*options); });
}

}  // namespace arbiter::cli
