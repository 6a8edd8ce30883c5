// arbiter rules: the extracted rules, as the paper writes them.
#include <iostream>
#include <memory>

#include <CLI/CLI.hpp>

#include "cli/model_files.hpp"
#include "cli/verbs.hpp"
#include "rules/ask/report.hpp"
#include "rules/model/print_rules.hpp"

namespace arbiter::cli {
namespace {

struct RulesOptions {
  rules::ModelFiles files;
  bool json = false;
};

// Rules that contradict each other are shown as well: to see why is what one looks at them for.
int show_rules(const RulesOptions& options) {
  rules::Diagnostics diagnostics;
  const rules::RuleSet rules = rules::load(options.files, diagnostics);
  diagnostics.drop_notes();
  rules::write_text(std::cerr, diagnostics);
  if (diagnostics.has_errors()) return 1;
  if (options.json) {
    rules::write_rules_json(std::cout, rules);
  } else {
    rules::write_rules(std::cout, rules);
  }
  return 0;
}

}  // namespace

void add_rules(CLI::App& app, int& exit_code) {
  const auto options = std::make_shared<RulesOptions>();
  CLI::App* verb =
      app.add_subcommand("rules", "Show the rules that Arbiter extracts from a model, by port");
  add_model_options(*verb, options->files);
  verb->add_flag("--json", options->json, "Write them as JSON");
  verb->footer(
      "Example:\n  arbiter rules search_and_track.xml\n\n"
      "It proves nothing: rules that can hold together are shown, too. `arbiter check` finds "
      "them.");
  verb->callback([options, &exit_code] { exit_code = show_rules(*options); });
}

}  // namespace arbiter::cli
