// arbiter switch: puts another of the models in force that the daemon has loaded.
#include <chrono>
#include <cstdint>
#include <iostream>
#include <memory>
#include <random>
#include <string>
#include <thread>
#include <vector>

#include <CLI/CLI.hpp>
#include <nlohmann/json.hpp>

#include "cli/changes.hpp"
#include "cli/live.hpp"
#include "cli/switch_everywhere.hpp"
#include "cli/verbs.hpp"
#include "shm/utf8.hpp"
#include "wire/document.hpp"
#include "wire/link_call.hpp"

namespace arbiter::cli {
namespace {

// Links say twice a second at most what has changed.
constexpr std::chrono::milliseconds kLookPeriod{250};

struct SwitchOptions {
  std::string instance;
  std::string model;
  std::vector<std::string> without;  // hosts
  bool all = false;
  bool json = false;
};

int list(const SwitchOptions& options) {
  const wire::Status status = fetch_status("switch", options.instance);
  const auto& models = status.models;
  if (options.json) {
    std::cout << wire::write_document(to_json(models));
    return 0;
  }
  for (const auto& model : models) {
    std::cout << (model.in_force ? "* " : "  ") << model.name;
    for (const auto& file : model.files) std::cout << ' ' << shm::printable(file);
    if (model.application) {
      std::cout << ", application " << shm::printable(*model.application);
    }
    if (model.in_force && !model.as_loaded) {
      std::cout << "  (after a rollback, an older one is in force)";
    }
    std::cout << '\n';
  }
  if (models.empty() && status.model.refused) {
    std::cout << "no model is loaded, because the files of --model were refused; mend them, then "
                 "run arbiter reload: "
              << shm::printable(status.model.refused->why) << '\n';
  } else if (models.empty()) {
    std::cout << "no model is loaded; start the daemon with --model\n";
  }
  return 0;
}

// Nobody can guess it, and no two attempts have the same.
std::uint64_t new_attempt() {
  std::random_device random;
  std::uint64_t number = 0;
  while (number == 0) number = std::uint64_t{random()} << 32 | random();
  return number;
}

int switch_all(const SwitchOptions& options) {
  wire::LinkCall link(options.instance);
  const auto ask = [&](const std::string& verb, const std::string& text) {
    return link.ask_hosts({wire::kAllHosts, verb, text});
  };
  const auto look = [&] {
    std::this_thread::sleep_for(kLookPeriod);
    // Each time anew: a link that joins its network again hangs up.
    return wire::read_hosts(wire::LinkCall(options.instance).ask({"", "hosts"}));
  };
  const auto result = switch_everywhere({new_attempt(), options.model, options.without}, ask, look);
  if (options.json) {
    write_json(result, options.model);
  } else {
    write_text(result, options.model);
  }
  return exit_code_of(result);
}

int switch_model(const SwitchOptions& options) {
  if (options.model.empty()) return list(options);
  if (options.all) return switch_all(options);
  wire::Message question;
  question.kind = wire::MessageKind::kSwitch;
  question.set_name(options.model);
  return change_model("switch", options.instance, question, options.json);
}

}  // namespace

void add_switch(CLI::App& app, int& exit_code) {
  const auto options = std::make_shared<SwitchOptions>();
  CLI::App* verb =
      app.add_subcommand("switch", "Put another loaded model in force; without NAME, list them");
  verb->add_option("NAME", options->model, "As in arbiterd --model NAME=FILE")->type_name("NAME");
  CLI::Option* all = verb->add_flag("--all", options->all,
                                    "On all hosts (docs/hosts.md): none switches unless all can");
  verb->add_option("--without", options->without, "With --all: a host that is left out; repeatable")
      ->type_name("HOST")
      ->needs(all)
      ->expected(1)
      ->take_all();
  verb->add_flag("--json", options->json,
                 "Write the list, the daemon's report, or what each host has done, as JSON");
  add_instance_option(*verb, options->instance);
  verb->footer(R"(Example:
  arbiter switch          # * marks the one in force
  arbiter switch dance    # returns when it is in force, for all ports at once
  arbiter switch dance --all --without camera

The models were read and proved when the daemon started, or at the last arbiter reload; a switch
reads no file.

Exit codes: 0 done; 1 an error in what you asked about, or no daemon, or, with --all, no link: nothing
has switched; 2 wrong use; 3 with --all: some hosts have not switched, or that is not known)");
  verb->callback([options, &exit_code] {
    if (options->all && options->model.empty()) {
      throw CLI::ValidationError("--all", "it needs the NAME of a model");
    }
    exit_code = switch_model(*options);
  });
}

}  // namespace arbiter::cli
