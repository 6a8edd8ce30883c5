// arbiter graph: a model as a picture, still or of the running system.
#include <algorithm>
#include <cctype>
#include <filesystem>
#include <iostream>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <utility>

#include <CLI/CLI.hpp>
#include <nlohmann/json.hpp>

#include "cli/live.hpp"
#include "cli/model_files.hpp"
#include "cli/model_in_force.hpp"
#include "cli/output_file.hpp"
#include "cli/verbs.hpp"
#include "drawing/drawing.hpp"
#include "drawing/graphviz.hpp"
#include "rules/ask/report.hpp"
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
  double effort = 1;
  bool live = false;
  bool follow = false;
};

// All that Graphviz makes of it but dot, which is ours.
const std::set<std::string> formats{"svg", "png", "dot", "pdf", "ps", "eps", "jpg"};

// Throws CLI::ValidationError where the output's ending names no format.
std::string format_of(const GraphOptions& options) {
  if (!options.format.empty()) return options.format;
  std::string ending = std::filesystem::path(options.output).extension().string();
  if (ending.empty()) return "svg";
  ending.erase(0, 1);
  for (char& each : ending)
    each = static_cast<char>(std::tolower(static_cast<unsigned char>(each)));
  if (ending == "gv") return "dot";
  if (formats.contains(ending)) return ending;
  throw CLI::ValidationError("--output", "no picture is made of the ending of " + options.output +
                                             "; give --format, or one of .svg, .png, .pdf, .ps, "
                                             ".eps, .jpg, .dot and .gv");
}

class Picture {
 public:
  explicit Picture(const GraphOptions& options) : options_(options), format_(format_of(options)) {}

  // What is wrong with the model goes to standard error. False if it cannot be drawn.
  bool load(const rules::ModelTexts& texts) {
    require_no_input(options_.output, texts);
    rules::Diagnostics diagnostics;
    model_ = rules::load_all(texts, diagnostics);
    diagnostics.drop_notes();
    rules::write_text(std::cerr, diagnostics);
    view_ = options_.view == "behaviours"    ? View::kBehaviours
            : options_.view == "connections" ? View::kConnections
            : options_.view == "both"        ? View::kBoth
                                             : drawing::natural_view(model_);
    is_good_ = !diagnostics.has_errors();
    if (!is_good_) return false;
    if (options_.view == "behaviours" && model_.model.behaviours.empty()) {
      std::cerr << "arbiter: the model has no behaviours, only rules: --view connections draws "
                   "them\n";
    }
    check();
    return true;
  }
  // Else rules contradict each other: to see where is what one may draw them for.
  [[nodiscard]] bool is_good() const { return is_good_; }

  [[nodiscard]] const rules::RuleSet& rules() const { return model_.rules; }

  // Where nothing has changed, nothing is written.
  void write(const Situation* situation) {
    std::string text = drawing::draw(model_, view_, situation);
    if (text == last_) return;
    const drawing::Waiting waiting{[] {
      std::cerr << "arbiter: Graphviz is at work, which takes it long for hundreds of behaviours; "
                   "--format dot does without it, --view connections is smaller\n";
    }};
    write_output(options_.output,
                 format_ == "dot" ? text : drawing::lay_out(text, format_, waiting));
    last_ = std::move(text);
  }

 private:
  void check() {
    rules::Diagnostics proof;
    compile_model(model_.rules, proof, options_.effort);
    is_good_ = !proof.has_errors();
    proof.drop_notes();
    if (!is_good_) rules::write_text(std::cerr, proof);
  }

  const GraphOptions& options_;
  const std::string format_;
  rules::LoadedModel model_;
  View view_ = View::kBehaviours;
  bool is_good_ = false;
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

struct LiveSituation {
  Situation situation;
  bool fits = false;
  std::shared_ptr<json> model;  // what the daemon has in force
};

// The daemon reads one activity after another while the robot goes on, so that a picture might
// combine moments; what it says is taken when it fits together. Where it never does, the daemon has
// other rules than this model.
LiveSituation look(detail::NodeCore& node, const rules::RuleSet& rules) {
  constexpr int kTries = 20;
  LiveSituation seen;
  for (int i = 0; i < kTries && !seen.fits; ++i) {
    const json status = fetch_status(node);
    seen.situation = drawing::decide(rules, active_sources(status));
    seen.fits = agrees(status, seen.situation);
    seen.model = std::make_shared<json>(status.at("model"));
    seen.model->emplace("directory", status.at("directory"));
  }
  return seen;
}

// What the daemon has in force.
struct FetchedModel {
  json generation;
  std::optional<rules::ModelTexts> texts;  // none: it has them from a former daemon, as a table
};

FetchedModel fetch_model(detail::NodeCore& node) {
  const json document = fetch_document(node, shm::MessageKind::kModel);
  FetchedModel model{document.at("generation"), {}};
  if (!document.at("known").get<bool>()) return model;
  const auto text_of = [](const json& file) {
    return rules::FileText{file.at("path").get<std::string>(), file.at("text").get<std::string>()};
  };
  model.texts.emplace();
  for (const auto& file : document.at("models")) model.texts->models.push_back(text_of(file));
  if (const json& application = document.at("application"); !application.is_null()) {
    model.texts->application = text_of(application);
  }
  return model;
}

// As the daemon sends it: what is not UTF-8 has been replaced.
std::string as_sent(const std::string& text) {
  return json(text).dump(-1, ' ', false, json::error_handler_t::replace);
}

bool same_text(const rules::FileText& ours, const rules::FileText& theirs) {
  return as_sent(ours.content) == as_sent(theirs.content);
}

// An application that is not given may be left out: it decides nothing.
bool same_texts(const rules::ModelTexts& ours, const rules::ModelTexts& theirs) {
  if (ours.application &&
      (!theirs.application || !same_text(*ours.application, *theirs.application))) {
    return false;
  }
  return std::equal(ours.models.begin(), ours.models.end(), theirs.models.begin(),
                    theirs.models.end(), same_text);
}

// The files that the daemon names, where it does not know what was in them.
rules::ModelFiles files_of(const json& model) {
  rules::ModelFiles files;
  const auto from_here = [&](const json& file) {  // the daemon may run in another directory
    return path_from_here(file.get<std::string>(), model.at("directory").get<std::string>());
  };
  for (const auto& file : model.at("files")) files.models.push_back(from_here(file));
  if (!model.at("application").is_null()) files.application = from_here(model.at("application"));
  if (files.models.empty()) throw Error("the daemon has no model; give one: arbiter graph MODEL");
  return files;
}

class LivePicture {
 public:
  LivePicture(const GraphOptions& options, std::shared_ptr<detail::NodeCore> node)
      : options_(options), node_(std::move(node)), picture_(options) {}

  // False: the model cannot be drawn.
  bool update() {
    LiveSituation now = look(*node_, picture_.rules());
    if (drawn_ != now.model->at("generation")) {
      if (!load(*now.model)) return false;
      now = look(*node_, picture_.rules());
    }
    fits_ = now.fits;
    if (!fits_ && is_same_ && now.model->at("generation") == drawn_ &&
        !std::exchange(warned_, true)) {
      std::cerr << "arbiter: the daemon decides otherwise than this model does; is it the one in "
                   "force, and unchanged since? (arbiter status, arbiter reload)\n";
    }
    picture_.write(&now.situation);
    return true;
  }
  // Whether the picture is of what the daemon does.
  [[nodiscard]] bool is_true() const { return fits_ && is_same_ && picture_.is_good(); }
  // Another daemon may count its models from one again.
  void forget_model() { drawn_ = nullptr; }

 private:
  bool load(const json& model) {
    const FetchedModel in_force = fetch_model(*node_);
    if (!options_.files.models.empty()) {
      const rules::ModelTexts given = rules::read_texts(options_.files);
      if (!picture_.load(given)) return false;
      const bool is_none = in_force.generation == 0;
      is_same_ = !is_none && (!in_force.texts || same_texts(given, *in_force.texts));
      if (is_none) {
        std::cerr << "arbiter: the daemon has no model in force\n";
      } else if (!is_same_) {
        std::cerr << "arbiter: this is not the text of the model in force, model "
                  << in_force.generation << "; the daemon may decide otherwise than is shown "
                  << "(arbiter status names its files; arbiter reload has them read again)\n";
      }
    } else {
      const auto files = in_force.texts ? std::optional<rules::ModelFiles>() : files_of(model);
      if (in_force.texts && in_force.texts->models.empty() && !in_force.texts->application) {
        throw Error("the daemon has no model; give one: arbiter graph MODEL");
      }
      if (!picture_.load(files ? rules::read_texts(*files) : *in_force.texts)) return false;
    }
    drawn_ = in_force.generation;
    warned_ = false;
    return true;
  }

  const GraphOptions& options_;
  const std::shared_ptr<detail::NodeCore> node_;
  Picture picture_;
  json drawn_;  // the generation of the model that the picture is of
  bool fits_ = false;
  bool is_same_ = true;  // as far as it is known: given is what is in force
  bool warned_ = false;
};

int draw_live(const GraphOptions& options) {
  const auto node = connect("graph", options.instance);
  LivePicture picture(options, node);
  if (!picture.update()) return 1;
  return picture.is_true() ? 0 : 1;
}

int follow(const GraphOptions& options) {
  const shm::FileDescriptor interrupts = catch_interrupts();
  NodeOptions node_options = live_options(options.instance);
  node_options.on_waiting = [](const std::string&) {};  // said below, once
  const auto node = detail::make_node("arbiter-graph", node_options);
  LivePicture picture(options, node);
  if (!picture.update()) return 1;
  bool is_alone = false;
  for (shm::Nanoseconds next = shm::monotonic_now();;) {
    next = std::max(next + kFollowPeriod, shm::monotonic_now());
    if (sleep_until(next, interrupts)) return 0;
    try {
      if (!picture.update()) return 1;
      if (std::exchange(is_alone, false)) std::cerr << "arbiter: a daemon is there again\n";
    } catch (const Error& error) {
      picture.forget_model();
      if (std::exchange(is_alone, true)) continue;
      std::cerr << "arbiter: the daemon has gone (" << error.what() << "); " << options.output
                << " stays as it was until one comes\n";
    }
  }
}

int draw_still(const GraphOptions& options) {
  Picture picture(options);
  if (!picture.load(rules::read_texts(options.files))) return 1;
  picture.write(nullptr);
  return picture.is_good() ? 0 : 1;
}

int graph(const GraphOptions& options) {
  if (options.follow && options.output.empty()) {
    throw CLI::RequiredError("--output, the file that --follow writes anew,");
  }
  if (options.follow) return follow(options);
  if (options.live) return draw_live(options);
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
                   "svg, png, dot, pdf, ps, eps or jpg; without it by the ending of the file, svg "
                   "where it has none")
      ->check(CLI::IsMember(formats))
      ->type_name("FORMAT");
  verb->add_option("-o,--output", options->output, kOutputHelp)->type_name("FILE");
  add_effort_option(*verb, options->effort);
  verb->add_flag("--live", options->live, "Colour it by who is active and who wins now");
  verb->add_flag("--follow", options->follow, "As --live, and write it anew on each change");
  add_instance_option(*verb, options->instance);
  verb->footer(
      "Pictures are made by Graphviz (apt install graphviz); --format dot does without.\n"
      "Rules that contradict each other are drawn all the same.\n\n"
      "Exit codes: 0 drawn; 1 an error in the model, no daemon, no Graphviz, or a model that is "
      "not "
      "the one\nin force; 2 wrong use, or a file cannot be opened or written\n\n"
      "Examples:\n"
      "  arbiter graph search_and_track.xml -o behaviours.svg\n"
      "  arbiter graph search_and_track.xml --view connections --application application.xml -o "
      "ports.png\n"
      "  arbiter graph --follow -o now.svg");
  verb->callback([options, &exit_code] { exit_code = graph(*options); });
}

}  // namespace arbiter::cli
