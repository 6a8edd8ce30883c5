// arbiter graph: a model as a picture, still or of the running system.
#include <iostream>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <utility>

#include <CLI/CLI.hpp>
#include <nlohmann/json.hpp>

#include "cli/live.hpp"
#include "cli/model_in_force.hpp"
#include "cli/output_file.hpp"
#include "cli/verbs.hpp"
#include "drawing/drawing.hpp"
#include "drawing/graphviz.hpp"
#include "rules/report.hpp"
#include "shm/clock.hpp"

namespace arbiter::cli {
namespace {

using drawing::Situation;
using drawing::View;
using nlohmann::json;

constexpr shm::Nanoseconds kFollowPeriod = 100'000'000;

struct GraphOptions {
  rules::ModelFiles files;
  std::string view = "auto";
  std::string format;
  std::string output;
  std::string instance;
  bool live = false;
  bool follow = false;
};

std::string format_of(const GraphOptions& options) {
  if (!options.format.empty()) return options.format;
  if (options.output.ends_with(".png")) return "png";
  if (options.output.ends_with(".dot") || options.output.ends_with(".gv")) return "dot";
  return "svg";
}

class Picture {
 public:
  explicit Picture(const GraphOptions& options) : options_(options), format_(format_of(options)) {}

  // What is wrong with the model goes to standard error, once. False if it has errors.
  bool load(const rules::ModelFiles& files) {
    rules::Diagnostics diagnostics;
    model_ = rules::load_all(files, diagnostics);
    rules::write_text(std::cerr, diagnostics);
    view_ = options_.view == "behaviours"    ? View::kBehaviours
            : options_.view == "connections" ? View::kConnections
            : options_.view == "both"        ? View::kBoth
                                             : drawing::natural_view(model_);
    return !diagnostics.has_errors();
  }

  [[nodiscard]] const rules::RuleSet& rules() const { return model_.rules; }

  // Where nothing has changed, nothing is written.
  void write(const Situation* situation) {
    std::string text = drawing::draw(model_, view_, situation);
    if (text == last_) return;
    write_output(options_.output, format_ == "dot" ? text : drawing::lay_out(text, format_));
    last_ = std::move(text);
  }

 private:
  const GraphOptions& options_;
  const std::string format_;
  rules::LoadedModel model_;
  View view_ = View::kBehaviours;
  std::string last_;
};

std::set<std::string> active_sources(const json& status) {
  std::set<std::string> active;
  for (const auto& source : status.at("sources")) {
    if (source.at("active").get<bool>()) active.insert(source.at("name").get<std::string>());
  }
  return active;
}

// Whether the daemon names the winners that follow from the activities it names.
bool agrees(const json& status, const Situation& situation) {
  for (const auto& input : status.at("inputs")) {
    if (!input.at("arbitrated").get<bool>()) continue;
    const auto winner = situation.winners.find(input.at("name").get<std::string>());
    const json& reported = input.at("winner");
    const bool idle = winner == situation.winners.end();
    if (idle ? !reported.is_null() : reported.is_null() || reported != winner->second) return false;
  }
  return true;
}

struct Look {
  Situation situation;
  bool fits = false;
  json model;  // what the daemon has in force
};

// The daemon reads one activity after another while the robot goes on, so that a picture might
// combine moments; what it says is taken when it fits together. Where it never does, the daemon has
// other rules than this model.
Look look(detail::NodeCore& node, const rules::RuleSet& rules) {
  constexpr int kTries = 20;
  Look seen;
  for (int i = 0; i < kTries && !seen.fits; ++i) {
    const json status = fetch_status(node);
    seen.situation = drawing::decide(rules, active_sources(status));
    seen.fits = agrees(status, seen.situation);
    seen.model = status.at("model");
    seen.model["directory"] = status.at("directory");
  }
  return seen;
}

// The files that the daemon has in force, where none are given.
rules::ModelFiles files_in_force(const json& model, const rules::ModelFiles& given) {
  if (!given.models.empty()) return given;
  rules::ModelFiles files;
  const auto from_here = [&](const json& file) {  // the daemon may run in another directory
    return path_from_here(file.get<std::string>(), model.at("directory").get<std::string>());
  };
  for (const auto& file : model.at("files")) files.models.push_back(from_here(file));
  if (!model.at("application").is_null()) files.application = from_here(model.at("application"));
  if (files.models.empty()) throw Error("the daemon has no model; give one: arbiter graph MODEL");
  return files;
}

int draw_live(const GraphOptions& options) {
  std::optional<shm::FileDescriptor> interrupts;
  if (options.follow) interrupts = catch_interrupts();
  const auto node = connect("graph", options.instance);
  Picture picture(options);
  json drawn;  // the generation of the model that the picture is of
  bool warned = false;
  for (shm::Nanoseconds next = shm::monotonic_now();; next += kFollowPeriod) {
    Look now = look(*node, picture.rules());
    if (drawn != now.model.at("generation")) {
      if (!picture.load(files_in_force(now.model, options.files))) return 1;
      drawn = now.model.at("generation");
      warned = false;
      now = look(*node, picture.rules());
    }
    if (!now.fits && now.model.at("generation") == drawn && !std::exchange(warned, true)) {
      std::cerr << "arbiter: the daemon decides otherwise than this model does; is it the one in "
                   "force, and unchanged since? (arbiter status, arbiter reload)\n";
    }
    picture.write(&now.situation);
    if (!options.follow) return now.fits ? 0 : 1;
    if (sleep_until(next + kFollowPeriod, *interrupts)) return 0;
  }
}

int draw_still(const GraphOptions& options) {
  Picture picture(options);
  if (!picture.load(options.files)) return 1;
  picture.write(nullptr);
  return 0;
}

int graph(const GraphOptions& options) {
  if (options.follow && options.output.empty()) {
    throw CLI::RequiredError("--output, the file that --follow writes anew,");
  }
  if (options.live || options.follow) return draw_live(options);
  if (options.files.models.empty()) throw CLI::RequiredError("MODEL, or --live,");
  return draw_still(options);
}

}  // namespace

void add_graph(CLI::App& app, int& exit_code) {
  const auto options = std::make_shared<GraphOptions>();
  CLI::App* verb = app.add_subcommand("graph", "Draw a model, or what it is doing now");
  verb->add_option("MODEL", options->files.models,
                   "Files of behaviours and rules; with --live, without it those in force")
      ->type_name("FILE");
  verb->add_option("--application", options->files.application,
                   "File that says which connections exist; without it, those of the model")
      ->type_name("FILE");
  verb->add_option("--view", options->view,
                   "behaviours: in meta-behaviours, with inhibitions; connections: components, "
                   "ports, rules; both; auto: behaviours if there are any")
      ->check(CLI::IsMember({"auto", "behaviours", "connections", "both"}))
      ->type_name("WHICH");
  verb->add_option("--format", options->format,
                   "svg, png or dot; without it by the ending of the file, else svg")
      ->check(CLI::IsMember({"svg", "png", "dot"}))
      ->type_name("FORMAT");
  verb->add_option("-o,--output", options->output, kOutputHelp)->type_name("FILE");
  verb->add_flag("--live", options->live, "Colour it by who is active and who wins now");
  verb->add_flag("--follow", options->follow, "As --live, and write it anew on each change");
  add_instance_option(*verb, options->instance);
  verb->footer(
      "SVG and PNG are made by Graphviz (apt install graphviz); --format dot does without.\n\n"
      "Exit codes: 0 drawn; 1 an error in the model, no daemon, no Graphviz, or a daemon that "
      "decides\notherwise than the model; 2 wrong use, or a file cannot be opened or written\n\n"
      "Examples:\n"
      "  arbiter graph search_and_track.xml -o behaviours.svg\n"
      "  arbiter graph search_and_track.xml --view connections --application application.xml -o "
      "ports.png\n"
      "  arbiter graph --follow -o now.svg");
  verb->callback([options, &exit_code] { exit_code = graph(*options); });
}

}  // namespace arbiter::cli
