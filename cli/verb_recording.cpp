// arbiter recording: what a recording's file has, and a whole file from one that is not.
#include <memory>
#include <string>

#include <CLI/CLI.hpp>

#include "cli/answer.hpp"
#include "cli/recording_export.hpp"
#include "cli/recording_info.hpp"
#include "cli/recording_sample.hpp"
#include "cli/recording_winners.hpp"
#include "cli/verbs.hpp"

namespace arbiter::cli {
namespace {

struct RecordingOptions {
  std::string file;
  std::string output;
  bool json = false;
};

void add_info(CLI::App& parent, int& exit_code) {
  const auto options = std::make_shared<RecordingOptions>();
  CLI::App* verb = parent.add_subcommand(
      "info", "Read all of an MCAP file, and show what it has, and whether it is whole");
  verb->add_option("FILE", options->file, "An MCAP file, of whatever program")->required();
  verb->add_flag("--json", options->json, "Write it as one JSON object");
  verb->footer(
      "Example:\n  arbiter recording info incident.mcap\n\n"
      "Exit codes: 0 the file is whole; 1 it is not: what is whole of it is shown; 2 wrong use, or "
      "a file\nthat cannot be opened or is not an MCAP file");
  verb->callback([options, &exit_code] {
    exit_code = or_cannot_tell([&] { return show_recording(options->file, options->json); });
  });
}

void add_repair(CLI::App& parent, int& exit_code) {
  const auto options = std::make_shared<RecordingOptions>();
  CLI::App* verb = parent.add_subcommand(
      "repair", "Write what is whole of an MCAP file to a new one, with indexes and a summary");
  verb->add_option("FILE", options->file, "An MCAP file, which stays as it is")->required();
  verb->add_option("-o,--output", options->output,
                   "The new file; without it, one beside FILE: a.repaired.mcap for a.mcap")
      ->type_name("FILE");
  verb->footer(
      "Example:\n  arbiter recording repair incident.mcap -o whole.mcap\n\n"
      "Exit codes: 0 written, or nothing to repair; 2 wrong use, or a file that cannot be opened "
      "or\n"
      "written, is there already, or of which nothing is whole");
  verb->callback(
      [options, &exit_code] { exit_code = repair_recording(options->file, options->output); });
}

}  // namespace

void add_recording(CLI::App& app, int& exit_code) {
  CLI::App* verb = app.add_subcommand(
      "recording",
      "Show what a recording has, a sample of it, and who commanded; repair or export it");
  verb->require_subcommand(1);
  add_info(*verb, exit_code);
  add_repair(*verb, exit_code);
  add_export(*verb, exit_code);
  add_recorded_winners(*verb, exit_code);
  add_recorded_sample(*verb, exit_code);
  verb->footer(
      "Examples:\n"
      "  arbiter recording info incident.mcap\n"
      "  arbiter recording winners incident.mcap --at 14:03:07\n"
      "  arbiter recording sample incident.mcap --source /Nav/cmd_vel:o -o last.bin\n"
      "  arbiter recording repair incident.mcap -o whole.mcap\n"
      "  arbiter recording export incident.mcap --trace trace.csv\n\n"
      "Exit codes: 0 done; 1 the file is not whole (info); 2 wrong use, or a file that cannot be "
      "opened\nor written");
}

}  // namespace arbiter::cli
