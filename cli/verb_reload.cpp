// arbiter reload: has the daemon read its files again, and tells what came of it.
#include <iostream>
#include <memory>
#include <string>

#include <CLI/CLI.hpp>

#include "cli/live.hpp"
#include "cli/verbs.hpp"

namespace arbiter::cli {
namespace {

int reload(const std::string& instance) {
  const auto node = connect("reload", instance);
  shm::Message question;
  question.kind = shm::MessageKind::kReload;
  const auto generation = node->ask(question, {-1, -1}).message.value;
  std::cout << "model " << generation << " is in force\n";
  return 0;
}

}  // namespace

void add_reload(CLI::App& app, int& exit_code) {
  const auto instance = std::make_shared<std::string>();
  CLI::App* verb = app.add_subcommand(
      "reload", "Have the daemon read its model and its policy again; a bad one changes nothing");
  add_instance_option(*verb, *instance);
  verb->footer("Example:\n  arbiter reload");
  verb->callback([instance, &exit_code] { exit_code = reload(*instance); });
}

}  // namespace arbiter::cli
