// arbiter history and arbiter rollback: which models were in force, and back to one of them.
#include <ctime>
#include <iomanip>
#include <iostream>
#include <memory>
#include <string>

#include <CLI/CLI.hpp>
#include <nlohmann/json.hpp>

#include "cli/changes.hpp"
#include "cli/live.hpp"
#include "cli/numbers.hpp"
#include "cli/verbs.hpp"
#include "wire/document.hpp"

namespace arbiter::cli {
namespace {

std::string wall_time_text(std::int64_t ms) {
  const auto seconds = static_cast<std::time_t>(ms / 1000);
  std::tm local{};
  char text[64];
  if (localtime_r(&seconds, &local) == nullptr ||
      std::strftime(text, sizeof text, "%F %T", &local) == 0) {
    return std::to_string(ms) + " ms";
  }
  return text;
}

struct HistoryOptions {
  std::string instance;
  bool json = false;
};

int history(const HistoryOptions& options) {
  const auto models = fetch_status("history", options.instance).history;
  if (options.json) {
    std::cout << wire::write_document(to_json(models));
    return 0;
  }
  for (const auto& model : models) {
    std::cout << std::setw(4) << model.generation << "  " << wall_time_text(model.since_ms) << "  "
              << model.name << "  " << model.how;
    if (model.by) std::cout << ", by " << *model.by;
    std::cout << (model.is_kept ? "\n" : "  (not kept)\n");
    if (model.changes) std::cout << "      " << *model.changes << '\n';
  }
  if (models.empty()) std::cout << "no model has been in force\n";
  return 0;
}

struct RollbackOptions {
  std::string instance;
  std::uint64_t generation = 0;
  bool dry_run = false;
  bool json = false;
};

int rollback(const RollbackOptions& options) {
  wire::Message question;
  question.link = options.generation;
  if (options.dry_run) {
    question.kind = wire::MessageKind::kReload;
    question.flags = wire::kDryRun | wire::kGoesBack;
    return preview_change("rollback", options.instance, question, options.json);
  }
  question.kind = wire::MessageKind::kRollback;
  return change_model("rollback", options.instance, question, options.json);
}

}  // namespace

void add_history(CLI::App& app, int& exit_code) {
  const auto options = std::make_shared<HistoryOptions>();
  CLI::App* verb = app.add_subcommand(
      "history",
      "Show the models that were in force, latest first: since when, and who asked for them");
  verb->add_flag("--json", options->json, "Write the daemon's JSON document");
  add_instance_option(*verb, options->instance);
  verb->footer("Example:\n  arbiter history");
  verb->callback([options, &exit_code] { exit_code = history(*options); });
}

void add_rollback(CLI::App& app, int& exit_code) {
  const auto options = std::make_shared<RollbackOptions>();
  CLI::App* verb = app.add_subcommand(
      "rollback", "Return to an earlier model; without GENERATION, to the previous one");
  verb->add_option("GENERATION", options->generation, "Its number in arbiter history")
      ->type_name("N")
      ->check(at_least_one());
  verb->add_flag("--dry-run", options->dry_run, "Only show which decisions would change");
  verb->add_flag("--json", options->json, "Write the daemon's report as JSON");
  add_instance_option(*verb, options->instance);
  verb->footer(R"(Example:
  arbiter rollback        # to the previous model; a second time: to the one before that
  arbiter rollback 3
  arbiter rollback 3 --dry-run

No file is read or changed: the next reload, and the next daemon, read them again.)");
  verb->callback([options, &exit_code] { exit_code = rollback(*options); });
}

}  // namespace arbiter::cli
