// arbiter check: what loading a model would say of it.
#include <iostream>
#include <memory>
#include <string>

#include <CLI/CLI.hpp>

#include "cli/model_files.hpp"
#include "cli/verbs.hpp"
#include "rules/report.hpp"

namespace arbiter::cli {
namespace {

struct CheckOptions {
  rules::ModelFiles files;
  bool json = false;
};

std::string counted(std::size_t count, const std::string& thing) {
  return std::to_string(count) + ' ' + thing + (count == 1 ? "" : "s");
}

void write_summary(std::ostream& out, const rules::CompiledModel& model) {
  std::size_t connections = 0;
  for (const auto& port : model.ports) connections += port.rules.size();
  out << "ok: " << counted(model.ports.size(), "port") << ", " << counted(connections, "connection")
      << ", " << counted(model.sources.size(), "source") << '\n';
}

int check(const CheckOptions& options) {
  rules::Diagnostics diagnostics;
  const auto model = load_model(options.files, diagnostics);
  if (options.json) {
    rules::write_json(std::cout, diagnostics);
  } else {
    rules::write_text(std::cerr, diagnostics);
    if (model) write_summary(std::cout, model->compiled);
  }
  return model ? 0 : 1;
}

}  // namespace

void add_check(CLI::App& app, int& exit_code) {
  const auto options = std::make_shared<CheckOptions>();
  CLI::App* verb = app.add_subcommand("check", "Check a model, and prove that one wins at most");
  add_model_options(*verb, options->files);
  verb->add_flag("--json", options->json, "Write what is found as JSON, to standard output");
  verb->footer("Example:\n  arbiter check search_and_track.xml --application application.xml");
  verb->callback([options, &exit_code] { exit_code = check(*options); });
}

}  // namespace arbiter::cli
