#include "cli/recording_export.hpp"

#include <functional>
#include <iostream>
#include <memory>
#include <sstream>
#include <string>

#include <CLI/CLI.hpp>

#include "cli/first_output.hpp"
#include "cli/model_files.hpp"
#include "cli/output_file.hpp"
#include "cli/recording_compile.hpp"
#include "cli/recording_part.hpp"
#include "cli/simulate_recording.hpp"
#include "evidence/export.hpp"

namespace arbiter::cli {
namespace {

struct ExportOptions {
  std::string file;
  std::string trace;
  std::string csv;
  PartOptions part;
  double effort = 1;
  bool replaces = false;
};

void warn_of_restarts(const evidence::Recorded& recorded) {
  if (recorded.runs.size() < 2) return;
  std::cerr
      << "arbiter: warning: a daemon came that knew nothing of what was active, which a trace "
         "cannot say: in it each activity goes on until its T is over\n";
}

int export_recording(const ExportOptions& options) {
  if (options.trace.empty() && options.csv.empty()) {
    throw CLI::ValidationError("export", "say what to write: --trace FILE, --csv FILE, or both");
  }
  require_no_input("--trace", options.trace, options.file);
  require_no_input("--csv", options.csv, options.file);
  if (!options.trace.empty() && !options.csv.empty()) {
    require_two_files("--trace", options.trace, "--csv", options.csv);
  }
  require_new_file(options.trace, options.replaces);
  require_new_file(options.csv, options.replaces);
  const auto recorded = load_for_simulation(options.file, options.part);
  warn_of_missed(recorded);
  evidence::Models models(recording_compiler(options.effort));
  const auto content_by = [&](const auto& writer) {
    std::ostringstream text;
    writer(recorded, models, text);
    return text.str();
  };
  const auto write_csv = [&] {
    if (!options.csv.empty()) write_output(options.csv, content_by(evidence::write_decisions));
  };
  if (options.trace.empty()) {
    write_csv();
  } else {
    warn_of_restarts(recorded);
    write_first(options.trace, content_by(evidence::write_trace), write_csv);
  }
  return 0;
}

}  // namespace

void add_export(CLI::App& parent, int& exit_code) {
  const auto options = std::make_shared<ExportOptions>();
  CLI::App* verb = parent.add_subcommand("export", "Write a recording as CSV");
  verb->add_option("FILE", options->file, "A recording that `arbiter record` has made")->required();
  verb->add_option("--trace", options->trace,
                   "What arrived and was deactivated, as `arbiter simulate --trace` reads it")
      ->type_name("FILE");
  verb->add_option("--csv", options->csv,
                   "What was decided live, in the form that `arbiter simulate` prints")
      ->type_name("FILE");
  add_part_options(*verb, options->part);
  add_effort_option(*verb, options->effort);
  add_force_option(*verb, options->replaces);
  verb->footer(
      "Example:\n  arbiter recording export incident.mcap --trace trace.csv --csv decisions.csv\n\n"
      "Exit codes: 0 written; 1 a file that `arbiter record` has not made, or a model of the "
      "recording cannot\nbe loaded; 2 wrong use, or a file that cannot be opened or written, or is "
      "there already");
  verb->callback([options, &exit_code] { exit_code = export_recording(*options); });
}

}  // namespace arbiter::cli
