// arbiter check: what loading a model would say of it, and what else can be proved about it.
#include <algorithm>
#include <iostream>
#include <memory>
#include <set>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include <CLI/CLI.hpp>

#include "cli/model_files.hpp"
#include "cli/progress.hpp"
#include "cli/verbs.hpp"
#include "gateway/mapping/check_mapping.hpp"
#include "gateway/mapping/check_owners.hpp"
#include "gateway/mapping/read_mapping.hpp"
#include "rules/ask/across_hosts.hpp"
#include "rules/ask/findings.hpp"
#include "rules/ask/host_places.hpp"
#include "rules/ask/report.hpp"
#include "rules/ask/verdict.hpp"
#include "rules/model/application_reader.hpp"
#include "rules/text/names.hpp"

namespace arbiter::cli {
namespace {

struct CheckOptions {
  rules::ModelFiles files;
  std::vector<std::string> statements;  // files
  std::vector<std::string> gateways;    // files: mappings
  std::string hosts;                    // file: an application that says where its modules run
  std::vector<std::string> silenced;    // codes
  double effort = 1;
  bool strict = false;
  bool json = false;
};

struct Statements {
  std::size_t proved = 0, refuted = 0, open = 0;
  std::size_t not_judged = 0;  // malformed, or of names that the model does not have
  rules::ProvedStatements facts;
  std::vector<rules::Verdict> verdicts;
};

// Of the warnings and notes that reading, compiling and proving a model can bring.
const std::vector<std::string_view> silenceable{"behaviour-on-two-hosts",
                                                "crosses-network",
                                                "decided-in-order",
                                                "duplicate-config",
                                                "duplicate-connection",
                                                "either-way",
                                                "forever-commands",
                                                "held-up-idle",
                                                "inhibition-across-ports",
                                                "inhibition-circle",
                                                "left-open",
                                                "localhost-among-hosts",
                                                "matches-nothing",
                                                "misspelt-element",
                                                "more-conflicts",
                                                "negated-across-hosts",
                                                "never-published",
                                                "never-read",
                                                "never-runs",
                                                "never-selected",
                                                "never-wins",
                                                "no-children",
                                                "no-config",
                                                "no-idle",
                                                "no-owner",
                                                "no-rule-at-port",
                                                "no-taker",
                                                "nobody-wins",
                                                "not-arbitrated",
                                                "not-at-one-instant",
                                                "pattern-as-name",
                                                "place-unknown",
                                                "proved",
                                                "similar-name",
                                                "source-on-two-hosts",
                                                "starved",
                                                "statement-on-two-hosts",
                                                "two-configurations",
                                                "two-outs",
                                                "two-owners",
                                                "unmentioned-port",
                                                "unreachable-children",
                                                "unused-define",
                                                "wrong-end"};

std::string problem_of_code(std::string& code) {
  if (std::find(silenceable.begin(), silenceable.end(), code) != silenceable.end()) return "";
  std::string all;
  for (const auto& each : silenceable) all += (all.empty() ? "" : ", ") + std::string(each);
  const auto similar = rules::find_similar(code, silenceable);
  return "no warning and no note has the code " + rules::quote(code) +
         (similar ? "; did you mean " + rules::quote(*similar) + "?" : ".") +
         " Errors cannot be silenced; what can be: " + all;
}

std::string summary_of(const rules::CompiledModel& model) {
  std::size_t connections = 0;
  for (const auto& port : model.ports) connections += port.rules.size();
  return rules::counted(model.ports.size(), "port") + ", " +
         rules::counted(connections, "connection") + ", " +
         rules::counted(model.sources.size(), "source");
}

// Whoever gives a statement in place of a file is told so.
std::string read_statements_at(const std::string& path) {
  try {
    return rules::read_bytes(path);
  } catch (const rules::FileError& error) {
    if (path.find("->") == std::string::npos && path.find('(') == std::string::npos) throw;
    throw rules::FileError(std::string(error.what()) +
                           "; --assert takes a file, with a statement on each line");
  }
}

// Statements are read even where there is no model that they could be true of: all problems are
// reported in one go.
Statements judge_statements(const CheckOptions& options, const rules::CompiledModel* model,
                            rules::Diagnostics& diagnostics, rules::Budget& budget) {
  Statements result;
  std::vector<rules::Statement> statements;  // of all files: they share the budget
  for (const auto& path : options.statements) {
    const rules::TextFile file(path, read_statements_at(path));
    std::size_t malformed = 0;
    for (auto& statement : rules::read_statements(file, diagnostics, &malformed)) {
      statements.push_back(std::move(statement));
    }
    result.not_judged += malformed;
  }
  if (model == nullptr) return result;
  auto verdicts = rules::judge(statements, *model, diagnostics, budget);
  result.not_judged += statements.size() - verdicts.size();
  rules::report(verdicts, diagnostics, options.json);
  for (const auto& verdict : verdicts) {
    using Kind = rules::Verdict::Kind;
    result.proved += verdict.kind == Kind::kProved ? 1 : 0;
    if (verdict.proved) result.facts.push_back(verdict.proved);
    result.refuted += verdict.kind == Kind::kRefuted ? 1 : 0;
    result.open += verdict.kind == Kind::kOpen ? 1 : 0;
  }
  result.verdicts = std::move(verdicts);
  return result;
}

// As statements: they are read in any case, and judged by a model that can be run.
void check_gateways(const CheckOptions& options, const rules::RuleSet* model,
                    rules::Diagnostics& diagnostics) {
  if (options.gateways.empty()) return;
  rules::Diagnostics of_mappings;
  std::vector<gateway::Mapping> mappings;
  for (const auto& path : options.gateways) {
    mappings.push_back(gateway::read_mapping_file(path, of_mappings));
  }
  if (!of_mappings.has_errors()) {
    const std::set<std::string> published = gateway::ports_of(mappings, true);
    diagnostics.silence_about("never-published", published);
    diagnostics.silence_about("never-read", published);  // it is declared for its T
    gateway::check_mappings(mappings, model, of_mappings);
    if (model != nullptr && model->texts->application) {
      const rules::FileText& text = *model->texts->application;
      rules::Diagnostics found_before;
      gateway::check_owners(
          mappings, *model,
          rules::read_application(rules::TextFile(text.path, text.content), found_before),
          of_mappings);
    } else if (model != nullptr) {
      gateway::check_takers(mappings, *model, of_mappings);
    }
  }
  diagnostics.add(std::move(of_mappings));
}

// "base 1 port and 1 source, head 1 port and 4 sources": what is on each host, if that is known.
std::string check_hosts(const CheckOptions& options, const Model* model,
                        const Statements& statements, rules::Diagnostics& diagnostics,
                        rules::Budget& budget) {
  if (options.hosts.empty()) return "";
  const rules::TextFile file(options.hosts, rules::read_bytes(options.hosts));
  rules::Diagnostics of_file;
  const rules::Application application = rules::read_application(file, of_file);
  // load_model() has reported what is wrong with an application: one that is given as that, or that
  // has its model in it.
  const auto& models = options.files.models;
  const bool was_read = options.files.application == options.hosts ||
                        (std::find(models.begin(), models.end(), options.hosts) != models.end() &&
                         of_file.count(rules::Severity::kError, "not-an-application") == 0);
  const bool is_fine = !of_file.has_errors();
  if (!was_read) diagnostics.add(std::move(of_file));
  if (!is_fine || model == nullptr) return "";
  const rules::SourceUses uses = rules::uses_of_sources(model->rules);
  const rules::HostPlaces places(model->rules, uses, application, options.hosts, diagnostics);
  rules::find_across_hosts(model->rules, model->compiled, uses, places, statements.verdicts,
                           diagnostics, budget);
  std::string summary;
  for (const auto& [host, count] : places.counts()) {
    summary += (summary.empty() ? "" : ", ") + host + " " +
               rules::counted(count.ports, "input port") + " and " +
               rules::counted(count.sources, "source");
  }
  return summary;
}

void write_summary(std::ostream& out, const Statements& statements) {
  const std::size_t judged = statements.proved + statements.refuted + statements.open;
  out << rules::counted(judged + statements.not_judged, "statement") << ": " << statements.proved
      << " proved, " << statements.refuted << " refuted, " << statements.open << " left open";
  if (statements.not_judged > 0) out << ", " << statements.not_judged << " could not be read";
  out << '\n';
}

int check(const CheckOptions& options) {
  rules::Diagnostics diagnostics;
  rules::Budget budget(rules::Budget::steps_of(options.effort));
  ProgressLine progress;
  budget.watch(progress.watch());
  const auto keep = options.hosts.empty() ? rules::Keep::kRules : rules::Keep::kProvenance;
  const auto model = load_model(options.files, diagnostics, budget, keep);
  const auto statements =
      judge_statements(options, model ? &model->compiled : nullptr, diagnostics, budget);
  if (model) {
    rules::find_more(model->rules, model->compiled, diagnostics, budget, statements.facts);
  }
  check_gateways(options, model ? &model->rules : nullptr, diagnostics);
  const std::string hosts =
      check_hosts(options, model ? &*model : nullptr, statements, diagnostics, budget);
  if (!model && !options.statements.empty()) {
    diagnostics.note("left-open", {options.statements.front(), 1, 1},
                     "the statements were not checked, because the model has errors");
  }
  progress.clear();
  diagnostics.silence(options.silenced);
  if (options.strict) diagnostics.make_warnings_errors();
  const bool failed = diagnostics.has_errors();
  if (options.json) {
    rules::write_json(std::cout, diagnostics);
    return failed ? 1 : 0;
  }
  rules::write_text(std::cerr, diagnostics);
  if (!options.statements.empty() && model) {
    write_summary(std::cout, statements);
  }
  if (!hosts.empty()) std::cout << "hosts: " << hosts << '\n';
  if (failed) {
    std::cout << "failed: " << rules::counts(diagnostics)
              << (options.strict ? " (--strict treats warnings as errors)\n" : "\n");
  } else {
    std::cout << "ok: " << summary_of(model->compiled) << '\n';
  }
  return failed ? 1 : 0;
}

}  // namespace

void add_check(CLI::App& app, int& exit_code) {
  const auto options = std::make_shared<CheckOptions>();
  CLI::App* verb = app.add_subcommand(
      "check", "Check a model, and prove that at most one connection wins at each port");
  add_model_options(*verb, options->files);
  verb->add_option("--assert", options->statements,
                   "File of statements that must be true in every state, one on each line")
      ->type_name("FILE")
      ->transform(dash_for_input())
      ->allow_extra_args(false);
  verb->add_option("--gateway", options->gateways,
                   "Mapping of a gateway, to be looked at beside the model (docs/gateways.md)")
      ->type_name("FILE")
      ->transform(dash_for_input())
      ->allow_extra_args(false);
  verb->add_option("--hosts", options->hosts,
                   "Application whose modules have <node>s: also check what crosses the network")
      ->type_name("FILE")
      ->transform(dash_for_input());
  verb->add_option("--silence", options->silenced,
                   "Hide warnings and notes with this code, such as nobody-wins")
      ->type_name("CODE")
      ->delimiter(',')
      ->allow_extra_args(false)
      ->check(CLI::Validator(problem_of_code, ""));
  add_effort_option(*verb, options->effort);
  verb->add_flag("--strict", options->strict, "Treat warnings as errors, except silenced ones");
  verb->add_flag("--json", options->json, "Write the findings as JSON, to standard output");
  verb->footer(
      "Example:\n"
      "  arbiter check search_and_track.xml --application application.xml\n"
      "  arbiter check search_and_track.xml --assert safety.txt --silence nobody-wins,starved\n"
      "  arbiter check robot.xml --gateway ros2.xml --gateway radar.xml\n"
      "  arbiter check robot.xml --hosts application.xml\n"
      "\nStatements are about sources and winners:\n"
      "  /collision:o -> idle(/Arm/pos:i)\n"
      "  winner(/Arm/pos:i) = /Teleop/pos:o -> not winner(/Base/vel:i) = /Nav/vel:o\n"
      "  winner(/Base/vel:i) = any(/Nav/*) -> winner(/Arm/pos:i) != winner(/Hand/pos:i)\n"
      "\nProofs take a bounded number of steps, the same on every machine, shared fairly. The "
      "check\n"
      "names each question that stays open: for a port or a statement that is an error, for "
      "anything\n"
      "else the note left-open. A model that needs --effort here also needs it at arbiterd.\n\n"
      "Exit codes: 0 no error (with --strict, no warning either); 1 an error, or a statement that "
      "is not\n"
      "proved; 2 wrong use, or a file that cannot be opened or written");
  verb->callback([options, &exit_code] { exit_code = check(*options); });
}

}  // namespace arbiter::cli
