#include "cli/model_files.hpp"

#include <string>
#include <utility>

#include <CLI/CLI.hpp>

#include "cli/numbers.hpp"
#include "cli/progress.hpp"

namespace arbiter::cli {

std::string take_input(std::string& file) {
  constexpr const char* kStandardInput = "/dev/stdin";
  static bool is_taken = false;
  if (file == "-") file = kStandardInput;
  if (file != kStandardInput || !std::exchange(is_taken, true)) return "";
  return "standard input is read for another file already, and only once; give this one by name";
}

CLI::Validator dash_for_input() { return {take_input, ""}; }

CLI::Option& add_model_options(CLI::App& verb, rules::ModelFiles& files) {
  CLI::Option* models =
      verb.add_option("MODEL", files.models,
                      "Files of behaviours and rules; together one model; -: standard input")
          ->type_name("FILE")
          ->transform(dash_for_input())
          ->required();
  verb.add_option(
          "--application", files.application,
          "File that says which connections exist; without it, the model's connections exist")
      ->type_name("FILE")
      ->transform(dash_for_input());
  return *models;
}

void add_effort_option(CLI::App& verb, double& effort) {
  verb.add_option("--effort", effort,
                  "Allow proofs this many times the usual number of steps, such as 10 or 0.1")
      ->type_name("FACTOR")
      ->check(number_between(rules::Budget::kLeastEffort, rules::Budget::kMostEffort));
}

namespace {

std::optional<Model> checked(rules::RuleSet rules, rules::CompiledModel compiled,
                             const rules::Diagnostics& diagnostics) {
  if (diagnostics.has_errors()) return std::nullopt;
  return Model{std::move(rules), std::move(compiled)};
}

}  // namespace

std::optional<Model> load_model(const rules::ModelFiles& files, rules::Diagnostics& diagnostics,
                                rules::Budget& budget, rules::Keep keep) {
  rules::RuleSet rules = rules::load(files, diagnostics, keep);
  rules::CompiledModel compiled = rules::compile(rules, diagnostics, budget);
  return checked(std::move(rules), std::move(compiled), diagnostics);
}

std::optional<Model> load_model(const rules::ModelFiles& files, rules::Diagnostics& diagnostics,
                                double effort, rules::Keep keep) {
  rules::RuleSet rules = rules::load(files, diagnostics, keep);
  rules::CompiledModel compiled = compile_model(rules, diagnostics, effort);
  diagnostics.drop_notes();
  return checked(std::move(rules), std::move(compiled), diagnostics);
}

rules::CompiledModel compile_model(const rules::RuleSet& rules, rules::Diagnostics& diagnostics,
                                   double effort) {
  rules::Budget budget(rules::Budget::steps_of(effort));
  ProgressLine progress;
  budget.watch(progress.watch());
  return rules::compile(rules, diagnostics, budget);
}

}  // namespace arbiter::cli
