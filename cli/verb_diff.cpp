// arbiter diff: in which states two models decide differently.
#include <filesystem>
#include <iostream>
#include <memory>
#include <string>
#include <system_error>

#include <CLI/CLI.hpp>

#include "cli/answer.hpp"
#include "cli/model_files.hpp"
#include "cli/progress.hpp"
#include "cli/verbs.hpp"
#include "rules/ask/model_diff.hpp"
#include "rules/ask/report.hpp"

namespace arbiter::cli {
namespace {

struct DiffOptions {
  std::string before, after;
  std::string application, application_before, application_after;
  double effort = 1;
  bool json = false;
};

// One file, or several that form a model, with commas between them.
std::vector<std::string> files_of(const std::string& argument) {
  std::error_code too_long;  // together they may be no name of a file
  if (argument.find(',') == std::string::npos || std::filesystem::exists(argument, too_long)) {
    return {argument};
  }
  return CLI::detail::split(argument, ',');
}

// As dash_for_input(), of each of them.
std::string take_inputs(std::string& argument) {
  std::string taken;
  for (std::string file : files_of(argument)) {
    if (std::string problem = take_input(file); !problem.empty()) return problem;
    taken += (taken.empty() ? "" : ",") + file;
  }
  argument = taken;
  return "";
}

std::string problem_of_common_file(std::string& file) {
  if (file != "-" && file != "/dev/stdin") return "";
  return "this is read for each of the two models, and standard input only once; give a file by "
         "name";
}

std::optional<Model> load_side(const DiffOptions& options, const std::string& files,
                               const std::string& application) {
  rules::ModelFiles model{files_of(files), {}};
  const std::string& given = application.empty() ? options.application : application;
  if (!given.empty()) model.application = given;
  rules::Diagnostics diagnostics;
  auto loaded = load_model(model, diagnostics, options.effort);
  // What a check finds beside errors is not what was asked for here.
  if (!loaded) rules::write_text(std::cerr, diagnostics);
  return loaded;
}

int diff(const DiffOptions& options) {
  constexpr int kEqual = 0, kDiffers = 1, kCannot = 2;
  const auto before = load_side(options, options.before, options.application_before);
  const auto after = load_side(options, options.after, options.application_after);
  if (!before || !after) return kCannot;
  ProgressLine progress;
  rules::Budget budget(rules::Budget::steps_of(options.effort) / 5);
  budget.watch(progress.watch());
  const auto found = rules::diff(before->compiled, after->compiled, budget);
  progress.clear();
  if (options.json) {
    rules::write_json(std::cout, found);
  } else {
    rules::write_text(std::cout, found);
  }
  if (found.is_open()) return kCannot;
  return found.differs() ? kDiffers : kEqual;
}

}  // namespace

void add_diff(CLI::App& app, int& exit_code) {
  const auto options = std::make_shared<DiffOptions>();
  CLI::App* verb = app.add_subcommand("diff", "Show in which states two models decide differently");
  verb->add_option("BEFORE", options->before,
                   "A model; if it has several files: a.xml,b.xml; -: standard input")
      ->type_name("FILE")
      ->transform(CLI::Validator(take_inputs, ""))
      ->required();
  verb->add_option("AFTER", options->after, "The model to compare it with")
      ->type_name("FILE")
      ->transform(CLI::Validator(take_inputs, ""))
      ->required();
  verb->add_option("--application", options->application, "Connections of both models")
      ->type_name("FILE")
      ->check(CLI::Validator(problem_of_common_file, ""));
  verb->add_option("--application-before", options->application_before, "Connections of BEFORE")
      ->type_name("FILE")
      ->transform(dash_for_input());
  verb->add_option("--application-after", options->application_after, "Connections of AFTER")
      ->type_name("FILE")
      ->transform(dash_for_input());
  add_effort_option(*verb, options->effort);
  verb->add_flag("--json", options->json, "Write the differences as JSON");
  verb->footer(
      "Example:\n  arbiter diff search_and_track.xml new.xml\n\n"
      "Exit codes: 0 they decide alike in every state; 1 they differ; 2 diff cannot tell, wrong "
      "use,\n"
      "or a file that cannot be opened or written");
  verb->callback(
      [options, &exit_code] { exit_code = or_cannot_tell([&] { return diff(*options); }); });
}

}  // namespace arbiter::cli
