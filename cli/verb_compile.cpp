// arbiter compile: the application with the rules of its arbiters merged in.
#include <filesystem>
#include <iostream>
#include <memory>
#include <stdexcept>
#include <string>

#include <CLI/CLI.hpp>

#include "cli/model_files.hpp"
#include "cli/output_file.hpp"
#include "cli/verbs.hpp"
#include "rules/ask/report.hpp"
#include "rules/model/application_writer.hpp"
#include "rules/text/xml.hpp"
#include "shm/memory_file.hpp"

namespace arbiter::cli {
namespace {

struct CompileOptions {
  rules::ModelFiles files;
  std::string output;
  double effort = 1;
  bool replaces = false;
};

// The application given; else the one that the model is in already; else one made of the model. All
// as it was read for the rules: a pipe could not be read again, and a file may say something else.
std::string merge(const rules::RuleSet& rules) {
  const rules::ModelTexts& texts = *rules.texts;
  if (texts.application) return rules::merge_rules(rules, texts.application->content);
  const std::string* application = nullptr;
  for (const rules::FileText& file : texts.models) {
    if (rules::root_name(file.content) != "application") continue;
    if (application != nullptr) {
      throw std::runtime_error(
          "the model is in more than one application; say by --application "
          "which of them gets the rules");
    }
    application = &file.content;
  }
  if (application != nullptr) return rules::merge_rules(rules, *application);
  return rules::write_application(rules,
                                  std::filesystem::path(texts.models.front().path).stem().string());
}

// What was written is read as anybody will read it, before anybody does.
void check_by_reading_back(const std::string& content, const rules::RuleSet& rules) {
  const shm::FileDescriptor memory = shm::memory_file("arbiter-compile", content);
  rules::Diagnostics diagnostics;
  const rules::RuleSet read =
      rules::load({{"/proc/self/fd/" + std::to_string(memory.get())}, {}}, diagnostics);
  for (const auto& item : diagnostics.items()) {
    if (item.severity != rules::Severity::kError) continue;
    throw std::runtime_error("the rules cannot be written as a file that could be read again: " +
                             item.message);
  }
  if (!rules::same_rules(read, rules)) {
    throw std::logic_error(
        "the result reads back as different rules; this is a bug in arbiter: please report it");
  }
}

int compile(const CompileOptions& options) {
  rules::Diagnostics diagnostics;
  const auto model = load_model(options.files, diagnostics, options.effort);
  rules::write_text(std::cerr, diagnostics);
  if (!model) return 1;
  require_no_input(options.output, *model->rules.texts);
  const std::string content = merge(model->rules);
  check_by_reading_back(content, model->rules);
  if (holds_already(options.output, content)) return 0;
  require_new_file(options.output, options.replaces);
  write_output(options.output, content);
  return 0;
}

}  // namespace

void add_compile(CLI::App& app, int& exit_code) {
  const auto options = std::make_shared<CompileOptions>();
  CLI::App* verb =
      app.add_subcommand("compile", "Write the application with the rules merged into it");
  add_model_options(*verb, options->files);
  add_effort_option(*verb, options->effort);
  verb->add_option("-o,--output", options->output, kOutputHelp)->type_name("FILE");
  add_force_option(*verb, options->replaces);
  verb->footer(
      "The result is the text of the application file with one more element, <arbitration>, which "
      "holds\nthe rules of each input port. You can use it as an application, and as a model that "
      "decides in\nthe same way. Without --application, the result is a new application with the "
      "connections that\nthe model configures. A file that is there already is replaced only with "
      "--force:\nsomebody may have changed it.\n\n"
      "Examples:\n"
      "  arbiter compile search_and_track.xml --application application.xml -o merged.xml\n"
      "  arbiter check merged.xml\n"
      "  arbiterd --model merged.xml\n\n"
      "Exit codes: 0 written; 1 an error in the model, or rules too large to be read again; 2 "
      "wrong use, a file\n"
      "that cannot be opened or written, or an output that is one of the inputs, or is there "
      "already");
  verb->callback([options, &exit_code] { exit_code = compile(*options); });
}

}  // namespace arbiter::cli
