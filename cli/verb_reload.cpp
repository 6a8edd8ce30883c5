// arbiter reload: has the daemon read its files again, and tells what came of it.
#include <memory>
#include <string>

#include <CLI/CLI.hpp>

#include "cli/changes.hpp"
#include "cli/live.hpp"
#include "cli/verbs.hpp"

namespace arbiter::cli {
namespace {

struct ReloadOptions {
  std::string instance;
  bool dry_run = false;
  bool json = false;
};

int reload(const ReloadOptions& options) {
  wire::Message question;
  question.kind = wire::MessageKind::kReload;
  question.flags = options.dry_run ? wire::kDryRun : 0u;
  if (!options.dry_run) return change_model("reload", options.instance, question, options.json);
  return preview_change("reload", options.instance, question, options.json);
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
