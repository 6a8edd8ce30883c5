// arbiter simulate: what a model would have decided, sample by sample.
#include <iostream>
#include <memory>
#include <set>
#include <string>
#include <vector>

#include <CLI/CLI.hpp>

#include "cli/model_files.hpp"
#include "cli/verbs.hpp"
#include "rules/report.hpp"
#include "rules/simulation.hpp"
#include "rules/trace.hpp"

namespace arbiter::cli {
namespace {

struct SimulateOptions {
  rules::ModelFiles files;
  std::string trace;
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
  const auto model = load_model(options.files, diagnostics);
  const auto events = rules::read_trace(options.trace, diagnostics);
  if (!model || diagnostics.has_errors()) {
    rules::write_text(std::cerr, diagnostics);
    return 1;
  }
  rules::Simulation simulation(model->compiled);
  note_unknown_sources(simulation, options.trace, events, diagnostics);
  rules::write_text(std::cerr, diagnostics);
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
  verb->footer("Example:\n  arbiter simulate search_and_track.xml --trace trace.csv");
  verb->callback([options, &exit_code] { exit_code = simulate(*options); });
}

}  // namespace arbiter::cli
