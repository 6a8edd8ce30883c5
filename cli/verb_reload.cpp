// arbiter reload: has the daemon read its files again, and tells what came of it.
#include <iostream>
#include <memory>
#include <string>
#include <vector>

#include <CLI/CLI.hpp>

#include "cli/changes.hpp"
#include "cli/live.hpp"
#include "cli/verbs.hpp"
#include "rules/text/names.hpp"

namespace arbiter::cli {
namespace {

struct ReloadOptions {
  std::string instance;
  bool dry_run = false;
  bool json = false;
};

// One model of several, in a dry run. A difference begins with a line of its own.
void write_changes(const wire::ModelComparison& model, bool is_alone) {
  const std::string text = model.changes
                               ? model.changes->text
                               : "not compared: the model in force comes from an earlier daemon\n";
  const bool is_one_line = text.find('\n') + 1 == text.size();
  if (!is_alone) {
    std::cout << model.name << (model.in_force ? " (in force):" : ":")
              << (is_one_line ? ' ' : '\n');
  }
  std::cout << text;
}

int reload(const ReloadOptions& options) {
  wire::Message question;
  question.kind = wire::MessageKind::kReload;
  question.flags = options.dry_run ? wire::kDryRun : 0u;
  if (!options.dry_run) return change_model("reload", options.instance, question, options.json);
  const auto report = ask_for_change("reload", options.instance, question, options.json);
  if (options.json || !report.ok) return report.ok ? 0 : 1;
  const auto models = report.models.value_or(std::vector<wire::ModelComparison>());
  for (const auto& model : models) write_changes(model, models.size() == 1);
  write_dropped("reload", options.instance, report);
  if (report.policy && report.policy->differs) {
    std::cout << "the policy " << report.policy->file << " differs from the one in force: it has "
              << rules::counted(report.policy->rules, "rule") << '\n';
  }
  std::cout << "this was a dry run: arbiter reload puts the files in force\n";
  return 0;
}

}  // namespace

void add_reload(CLI::App& app, int& exit_code) {
  const auto options = std::make_shared<ReloadOptions>();
  CLI::App* verb = app.add_subcommand(
      "reload",
      "Make the daemon read its models and its policy again; if one has errors, nothing changes");
  verb->add_flag("--dry-run", options->dry_run,
                 "Only check the files, and show which decisions would change");
  verb->add_flag("--json", options->json, "Write the daemon's report as JSON");
  add_instance_option(*verb, options->instance);
  verb->footer(R"(Example:
  arbiter reload
  arbiter reload --dry-run     # 0: the files are good; 1: a reload would be refused

Findings are shown as by `arbiter check`. To go back: arbiter rollback.)");
  verb->callback([options, &exit_code] { exit_code = reload(*options); });
}

}  // namespace arbiter::cli
