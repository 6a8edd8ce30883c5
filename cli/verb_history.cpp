// arbiter history and arbiter rollback: which models were in force, and back to one of them.
#include <ctime>
#include <iomanip>
#include <iostream>
#include <memory>
#include <string>

#include <CLI/CLI.hpp>
#include <nlohmann/json.hpp>

#include "cli/conversation.hpp"
#include "cli/live.hpp"
#include "cli/numbers.hpp"
#include "cli/verbs.hpp"

namespace arbiter::cli {
namespace {

std::string time_text(std::int64_t ms) {
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
  const auto status = fetch_status(*connect("history", options.instance));
  const auto& models = status.at("history");
  if (options.json) {
    std::cout << models.dump(2) << '\n';
    return 0;
  }
  for (const auto& model : models) {
    std::cout << std::setw(4) << model.at("generation").get<std::uint64_t>() << "  "
              << time_text(model.at("since_ms").get<std::int64_t>()) << "  "
              << model.at("name").get<std::string>() << "  " << model.at("how").get<std::string>();
    if (!model.at("by").is_null()) std::cout << ", by " << model.at("by").get<std::string>();
    std::cout << (model.at("is_kept").get<bool>() ? "\n" : "  (not kept)\n");
    if (!model.at("changes").is_null()) {
      std::cout << "      " << model.at("changes").get<std::string>() << '\n';
    }
  }
  if (models.empty()) std::cout << "no model has been in force\n";
  return 0;
}

struct RollbackOptions {
  std::string instance;
  std::uint64_t generation = 0;
  bool json = false;
};

int rollback(const RollbackOptions& options) {
  shm::Message question;
  question.kind = shm::MessageKind::kRollback;
  question.link = options.generation;
  return write_result(
      Conversation("rollback", options.instance).ask_for_change(question, options.json),
      options.json);
}

}  // namespace

void add_history(CLI::App& app, int& exit_code) {
  const auto options = std::make_shared<HistoryOptions>();
  CLI::App* verb = app.add_subcommand(
      "history", "Show which models were in force, the latest first: since when, and by whom");
  verb->add_flag("--json", options->json, "As the daemon's JSON document");
  add_instance_option(*verb, options->instance);
  verb->footer("Example:\n  arbiter history");
  verb->callback([options, &exit_code] { exit_code = history(*options); });
}

void add_rollback(CLI::App& app, int& exit_code) {
  const auto options = std::make_shared<RollbackOptions>();
  CLI::App* verb = app.add_subcommand(
      "rollback", "Put a model in force again that was; without GENERATION, the one before");
  verb->add_option("GENERATION", options->generation, "As arbiter history shows it")
      ->type_name("N")
      ->check(at_least_one());
  verb->add_flag("--json", options->json, "Write the daemon's report as JSON");
  add_instance_option(*verb, options->instance);
  verb->footer(R"(Example:
  arbiter rollback        # to the one before; again: one further back
  arbiter rollback 3

No file is read or changed: the next reload, and the next daemon, read them again.)");
  verb->callback([options, &exit_code] { exit_code = rollback(*options); });
}

}  // namespace arbiter::cli
