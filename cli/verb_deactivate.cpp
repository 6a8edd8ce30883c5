// arbiter deactivate: ends the activity of a source whose process is gone.
#include <iostream>
#include <memory>
#include <string>
#include <vector>

#include <CLI/CLI.hpp>

#include "cli/live.hpp"
#include "cli/other_hosts.hpp"
#include "cli/verbs.hpp"

namespace arbiter::cli {
namespace {

struct DeactivateOptions {
  std::string source;
  std::string instance;
};

int deactivate(const DeactivateOptions& options) {
  wire::Call daemon(caller("deactivate", options.instance));
  wire::Message question;
  question.kind = wire::MessageKind::kDeactivate;
  question.set_name(options.source);
  const bool was_active = daemon.ask(question).message.value != 0;
  std::cout << options.source << (was_active ? " is inactive now\n" : " was not active\n");
  const std::vector<std::string> others = names_of_other_hosts(options.instance);
  if (!others.empty()) {
    std::cout << "each host keeps its own activity of it: where it is still active (arbiter status "
                 "--all), run this there, too\n";
  }
  return 0;
}

}  // namespace

void add_deactivate(CLI::App& app, int& exit_code) {
  const auto options = std::make_shared<DeactivateOptions>();
  CLI::App* verb =
      app.add_subcommand("deactivate", "End the activity of a source whose process is gone");
  verb->add_option("SOURCE", options->source, "An output port's name")->required();
  add_instance_option(*verb, options->instance);
  verb->footer(
      "Example:\n  arbiter deactivate /collision:o\n\n"
      "It is about this host alone: other hosts that have heard the source, by arbiter-link, keep "
      "it\n"
      "active until it is deactivated there, too.");
  verb->callback([options, &exit_code] { exit_code = deactivate(*options); });
}

}  // namespace arbiter::cli
