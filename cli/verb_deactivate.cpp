// arbiter deactivate: ends the activity of a source whose process is gone.
#include <iostream>
#include <memory>
#include <stdexcept>
#include <string>
#include <string_view>
#include <vector>

#include <CLI/CLI.hpp>

#include "cli/live.hpp"
#include "cli/other_hosts.hpp"
#include "cli/port_name.hpp"
#include "cli/verbs.hpp"
#include "rules/text/names.hpp"

namespace arbiter::cli {
namespace {

struct DeactivateOptions {
  std::string source;
  std::string instance;
};

// "; did you mean "/Lock:o"?" of a name that nobody has; empty: there is nothing to advise.
std::string advice(const DeactivateOptions& options) try {
  const wire::Status status = fetch_status("deactivate", options.instance);
  if (status.find_source(options.source) != nullptr) return {};
  if (status.find_input(options.source) != nullptr) {
    return "; it is an input port: name the output port that is to be inactive";
  }
  std::vector<std::string_view> names;
  for (const wire::SourceStatus& source : status.sources) names.push_back(source.name);
  return rules::advise(options.source, names, "`arbiter status` lists all sources");
} catch (const wire::CallError&) {
  return {};  // who may end an activity need not be allowed to see all
}

bool end_activity(const DeactivateOptions& options) try {
  wire::Call daemon(caller("deactivate", options.instance));
  wire::Message question;
  question.kind = wire::MessageKind::kDeactivate;
  question.set_name(options.source);
  return daemon.ask(question).message.value != 0;
} catch (const wire::RefusedError& error) {
  throw std::runtime_error(error.what() + advice(options));
}

int deactivate(const DeactivateOptions& options) {
  const bool was_active = end_activity(options);
  std::cout << options.source << (was_active ? " is inactive now\n" : " was not active\n");
  if (has_others(hosts_if_linked(options.instance))) {
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
  verb->add_option("SOURCE", options->source, "An output port's name")
      ->required()
      ->check(name_of_port());
  add_instance_option(*verb, options->instance);
  verb->footer(R"(Example:
  arbiter deactivate /collision:o

It is about this host alone: other hosts that have heard the source, by arbiter-link, keep it
active until it is deactivated there, too.)");
  verb->callback([options, &exit_code] { exit_code = deactivate(*options); });
}

}  // namespace arbiter::cli
