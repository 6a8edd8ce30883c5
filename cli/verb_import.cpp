// arbiter import: a model and a mapping from the parameters of another multiplexer.
#include <algorithm>
#include <filesystem>
#include <iostream>
#include <memory>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include <CLI/CLI.hpp>

#include "cli/first_output.hpp"
#include "cli/model_files.hpp"
#include "cli/numbers.hpp"
#include "cli/output_file.hpp"
#include "cli/verbs.hpp"
#include "gateway/mapping/read_mapping.hpp"
#include "importing/import.hpp"
#include "importing/topic_names.hpp"
#include "rules/ask/report.hpp"
#include "rules/model/load.hpp"
#include "rules/prove/compile.hpp"
#include "rules/text/names.hpp"
#include "rules/text/text_file.hpp"
#include "shm/utf8.hpp"

namespace arbiter::cli {
namespace {

constexpr std::uint32_t kMaxDomain = 230;  // DDS has ports for so many

struct ImportVerbOptions {
  std::string kind;
  std::vector<std::string> files;
  std::string output, mapping, directory;
  std::string idle = "auto";
  bool replaces = false;
  importing::ImportOptions import;
};

std::vector<importing::InputFile> read_files(const ImportVerbOptions& options) {
  std::vector<importing::InputFile> files;
  for (const std::string& path : options.files) {
    files.push_back({path, rules::read_bytes(path, importing::kMaxYamlBytes)});
  }
  return files;
}

// What is to be written is read as anybody will read it, before anybody does. A model that breaks a
// limit of Arbiter's is the user's to mend; any other error is ours.
using Problems = std::vector<std::string>;

void add_problems(const std::string& what, const rules::Diagnostics& diagnostics,
                  const std::string& of_zeros, Problems& problems) {
  for (const auto& item : diagnostics.items()) {
    if (item.severity != rules::Severity::kError) continue;
    std::string problem = "the " + what +
                          " would be refused, nothing was written: " + item.message + " [" +
                          item.code + "]" + (item.code == "idle-size" ? of_zeros : "");
    // A type that cannot be is that of each topic.
    if (std::find(problems.begin(), problems.end(), problem) != problems.end()) continue;
    problems.push_back(std::move(problem));
  }
}

void read_back(const rules::ModelTexts& texts, Problems& problems) {
  rules::Diagnostics diagnostics;
  rules::compile(rules::load(texts, diagnostics), diagnostics);
  add_problems("model", diagnostics, "", problems);
}

void read_back(const rules::TextFile& mapping, Problems& problems) {
  rules::Diagnostics diagnostics;
  gateway::read_mapping(mapping, diagnostics);
  // Nothing else sends what has a size.
  add_problems("mapping", diagnostics,
               "; leave out --idle zero, and name the sample in the mapping once that is written",
               problems);
}

// What can be found in a mapping of which only the way out is known.
Problems problems_of_way_out(importing::Plan plan, const std::string& mapping) {
  Problems problems;
  if (plan.output_topic.empty()) return problems;  // which has been reported
  plan.commands.clear();
  plan.locks.clear();
  read_back(rules::TextFile(mapping, importing::write_mapping(plan, "")), problems);
  return problems;
}

int say_problems(const Problems& problems) {
  for (const std::string& each : problems) {
    std::cerr << "arbiter: " << shm::printable(each, "\n\t") << '\n';
  }
  return 1;
}

void choose_outputs(ImportVerbOptions& options) {
  if (options.directory.empty()) return;
  const std::filesystem::path directory(options.directory);
  options.output = (directory / "model.xml").string();
  options.mapping = (directory / "mapping.xml").string();
}

void require_other_files(const ImportVerbOptions& options) {
  for (const std::string& input : options.files) {
    require_no_input("--output", options.output, input);
    require_no_input("--mapping", options.mapping, input);
  }
  if (options.mapping.empty()) return;
  if (options.mapping == "-" && options.output.empty()) {
    throw rules::FileError(
        "--mapping - is standard output, where the model goes without --output; nothing was "
        "written: give one of them a file");
  }
  if (options.output.empty()) return;
  require_two_files("--output", options.output, "--mapping", options.mapping);
}

// Whoever imports goes on by hand from what was written.
void require_new_files(const ImportVerbOptions& options) {
  for (const std::string& output : {options.output, options.mapping}) {
    require_new_file(output, options.replaces);
  }
}

void make_directory(const std::string& path) {
  if (path.empty()) return;
  std::error_code error;
  std::filesystem::create_directories(path, error);
  if (!error) return;
  throw rules::FileError("cannot make the folder " + path + ": " + error.message());
}

int import(ImportVerbOptions options) {
  choose_outputs(options);
  require_other_files(options);
  require_new_files(options);
  rules::Diagnostics diagnostics;
  const auto files = read_files(options);
  const auto plan = options.kind == importing::twist_mux_kind.name
                        ? importing::import_twist_mux(files, options.import, diagnostics)
                        : importing::import_cmd_vel_mux(files, options.import, diagnostics);
  rules::write_text(std::cerr, diagnostics);
  const bool has_mapping = !options.mapping.empty();
  if (!plan) return 1;
  if (diagnostics.has_errors()) {
    return say_problems(has_mapping ? problems_of_way_out(*plan, options.mapping) : Problems{});
  }
  const std::string name = options.output.empty() || options.output == "-"
                               ? "model.xml"
                               : std::filesystem::path(options.output).filename().string();
  const std::string model = importing::write_model(*plan);
  const std::string mapping = importing::write_mapping(*plan, name);
  Problems problems;
  read_back(rules::ModelTexts{{{name, model}}, {}}, problems);
  if (has_mapping) read_back(rules::TextFile(options.mapping, mapping), problems);
  if (!problems.empty()) return say_problems(problems);
  make_directory(options.directory);
  const auto write_model = [&] { write_output(options.output, model); };
  if (has_mapping) {
    write_first(options.mapping, mapping, write_model);
  } else {
    write_model();
  }
  return 0;
}

std::string problem_of_kind(std::string& kind) {
  const std::vector<std::string_view> kinds{importing::twist_mux_kind.name,
                                            importing::cmd_vel_mux_kind.name};
  if (std::find(kinds.begin(), kinds.end(), kind) != kinds.end()) return "";
  return "no multiplexer is called " + rules::quote(kind) +
         rules::advise(kind, kinds, "name twist_mux or cmd_vel_mux");
}

CLI::Validator name_of_node() {
  return {[](std::string& text) -> std::string {
            const bool is_pattern = text.find('*') != std::string::npos;
            return is_pattern ? '"' + text + "\" is not the name of one node, such as /robot/mux"
                              : "";
          },
          ""};
}

// A value that would make a file that nobody can read.
CLI::Validator name_of_topic(const char* what) {
  return {[what](std::string& text) -> std::string {
            const bool is_good =
                importing::resolve_topic(text, {"/", "node"}, importing::Relative::kToNamespace)
                    .has_value();
            return is_good ? "" : '"' + text + "\" is no " + what + ", such as /robot";
          },
          ""};
}

CLI::Validator name_of_namespace() {
  const CLI::Validator name = name_of_topic("namespace");
  return {[name](std::string& text) { return text == "/" ? std::string() : name(text); }, ""};
}

CLI::Validator name_of_type() {
  return {[](std::string& text) -> std::string {
            constexpr std::string_view kAllowed =
                "abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789_/";
            const bool is_good = text.find("/msg/") != std::string::npos &&
                                 text.find_first_not_of(kAllowed) == std::string::npos;
            return is_good ? "" : '"' + text + "\" is not a type, such as geometry_msgs/msg/Twist";
          },
          ""};
}

importing::IdleChoice idle_of(const std::string& word) {
  if (word == "zero") return importing::IdleChoice::kZero;
  return word == "none" ? importing::IdleChoice::kNothing : importing::IdleChoice::kByType;
}

void add_outputs(CLI::App& verb, ImportVerbOptions& options) {
  auto* output = verb.add_option("-o,--output", options.output,
                                 "File for the model; without it, or with -, standard output");
  output->type_name("FILE");
  auto* mapping = verb.add_option("--mapping", options.mapping,
                                  "File for the mapping of topics to ports; without it, none");
  mapping->type_name("FILE");
  verb.add_option("--out-dir", options.directory,
                  "Folder for both, model.xml and mapping.xml; made if it is not there")
      ->type_name("DIRECTORY")
      ->excludes(output)
      ->excludes(mapping);
  add_force_option(verb, options.replaces);
}

void add_names(CLI::App& verb, ImportVerbOptions& options) {
  verb.add_option("--node", options.import.node,
                  "The node to import, if the files have several, such as /robot/twist_mux")
      ->type_name("NAME")
      ->check(name_of_node());
  verb.add_option("--namespace", options.import.name_space,
                  "What topics without a slash in front are relative to; without it, what the "
                  "files say, or /")
      ->type_name("NAME")
      ->check(name_of_namespace());
  verb.add_option("--output-topic", options.import.output_topic,
                  "Topic of the commands that win; without it, the multiplexer's own: cmd_vel_out, "
                  "cmd_vel, or what the file says")
      ->type_name("TOPIC")
      ->check(name_of_topic("topic"));
  verb.add_option("--type", options.import.type,
                  "Type of the commands; without it, geometry_msgs/msg/Twist, or TwistStamped if "
                  "the file says use_stamped")
      ->type_name("TYPE")
      ->check(name_of_type());
  verb.add_option("--idle", options.idle,
                  "What is sent while nobody commands: zero (stop), none (as the multiplexers "
                  "do), or auto: zero if the type is Twist or TwistStamped of geometry_msgs")
      ->type_name("WHAT")
      ->check(one_of({"auto", "zero", "none"}));
  verb.add_option("--domain", options.import.domain,
                  "DDS domain of the topics; without it, ROS_DOMAIN_ID says, as for the nodes")
      ->type_name("NUMBER")
      ->check(whole_number_between(0, kMaxDomain));
}

}  // namespace

void add_import(CLI::App& app, int& exit_code) {
  const auto options = std::make_shared<ImportVerbOptions>();
  CLI::App* verb = app.add_subcommand(
      "import", "Make a model and a mapping of a twist_mux's or cmd_vel_mux's parameters");
  verb->add_option("KIND", options->kind, "twist_mux, or cmd_vel_mux (kobuki's, or yocs')")
      ->type_name("")
      ->required()
      ->check(CLI::Validator(problem_of_kind, ""));
  verb->add_option(
          "YAML", options->files,
          "Files of parameters, of ROS 2 or ROS 1; together they configure one multiplexer; -: "
          "standard input")
      ->type_name("FILE")
      ->transform(dash_for_input())
      ->required();
  add_outputs(*verb, *options);
  add_names(*verb, *options);
  verb->footer(
      "The model decides as the multiplexer does. What is dangerous in the file, and what cannot "
      "be kept,\nis reported with its line. Remapping in launch files is not read: correct the "
      "topics in the mapping.\n\n"
      "Examples:\n"
      "  arbiter import twist_mux twist_mux_topics.yaml twist_mux_locks.yaml --out-dir mux\n"
      "  arbiter import cmd_vel_mux cmd_vel_mux_params.yaml -o model.xml --mapping mapping.xml\n"
      "  arbiter check mux/model.xml\n\n"
      "Exit codes: 0 written; 1 an error in the files; 2 wrong use, or a file that cannot be "
      "opened or\nwritten, or is there already");
  verb->callback([options, &exit_code] {
    options->import.idle = idle_of(options->idle);
    exit_code = import(*options);
  });
}

}  // namespace arbiter::cli
