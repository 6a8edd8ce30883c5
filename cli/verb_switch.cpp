// arbiter switch: puts another of the models in force that the daemon has loaded.
#include <iostream>
#include <memory>
#include <string>

#include <CLI/CLI.hpp>
#include <nlohmann/json.hpp>

#include "cli/changes.hpp"
#include "cli/live.hpp"
#include "cli/verbs.hpp"
#include "wire/document.hpp"

namespace arbiter::cli {
namespace {

struct SwitchOptions {
  std::string instance;
  std::string model;
  bool json = false;
};

int list(const SwitchOptions& options) {
  const auto models = fetch_status("switch", options.instance).models;
  if (options.json) {
    std::cout << wire::write_document(to_json(models));
    return 0;
  }
  for (const auto& model : models) {
    std::cout << (model.in_force ? "* " : "  ") << model.name;
    for (const auto& file : model.files) std::cout << ' ' << file;
    if (model.application) std::cout << ", application " << *model.application;
    if (model.in_force && !model.as_loaded) {
      std::cout << "  (after a rollback, an older one is in force)";
    }
    std::cout << '\n';
  }
  if (models.empty()) std::cout << "no model is loaded; start the daemon with --model\n";
  return 0;
}

int switch_model(const SwitchOptions& options) {
  if (options.model.empty()) return list(options);
  wire::Message question;
  question.kind = wire::MessageKind::kSwitch;
  question.set_name(options.model);
  return write_result(ask_for_change("switch", options.instance, question, options.json),
                      options.json);
}

}  // namespace

void add_switch(CLI::App& app, int& exit_code) {
  const auto options = std::make_shared<SwitchOptions>();
  CLI::App* verb =
      app.add_subcommand("switch", "Put another loaded model in force; without NAME, list them");
  verb->add_option("NAME", options->model, "As in arbiterd --model NAME=FILE")->type_name("NAME");
  verb->add_flag("--json", options->json, "Write the list, or the daemon's report, as JSON");
  add_instance_option(*verb, options->instance);
  verb->footer(R"(Example:
  arbiter switch          # * marks the one in force
  arbiter switch dance    # returns when it is in force, for all ports at once

The models were read and proved when the daemon started, or at the last arbiter reload; a switch
reads no file.)");
  verb->callback([options, &exit_code] { exit_code = switch_model(*options); });
}

}  // namespace arbiter::cli
