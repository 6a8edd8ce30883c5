// arbiter graph: a model as a picture, still or of the running system.
#include <algorithm>
#include <cctype>
#include <cstdint>
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
#include "cli/output_file.hpp"
#include "cli/verbs.hpp"
#include "drawing/drawing.hpp"
#include "drawing/graphviz.hpp"
#include "rules/ask/report.hpp"
#include "shm/clock.hpp"
#include "watch/instance.hpp"
#include "watch/model_in_force.hpp"
#include "watch/picture.hpp"

namespace arbiter::cli {
namespace {

using drawing::Situation;
using drawing::View;
using nlohmann::json;

constexpr shm::Nanoseconds kFollowPeriod = 100'000'000;
// Where models change faster than they can be drawn.
constexpr int kMostLoads = 5;

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

// What the sources do at one moment, and who wins by the rules that are drawn.
struct LiveSituation {
  Situation situation;
  std::uint64_t generation = 0;  // of the model in force then
  bool fits = false;             // the daemon's table has the same winners
};

// Of a port whose name has not come yet nothing is known.
bool fits(const watch::Instance& instance, const watch::Picture& picture,
          const Situation& situation) {
  const auto& names = instance.port_names();
  return std::all_of(names.begin(), names.end(), [&](const auto& port) {
    if (!picture.snapshot.table.is_arbitrated(port.first)) return true;
    const shm::SourceId winner = picture.winner_at(port.first);
    const auto drawn = situation.winners.find(port.second);
    if (drawn == situation.winners.end()) return winner == shm::kNone;
    return winner != shm::kNone && instance.memory()->source_name(winner) == drawn->second;
  });
}

LiveSituation look(const watch::Instance& instance, const rules::RuleSet& rules) {
  const shm::DecisionMemory& memory = *instance.memory();
  for (;;) {
    const watch::Picture picture = watch::take_picture(memory, watch::all_sources);
    std::set<std::string> active;
    for (const auto& [source, word] : picture.words) {
      if (picture.is_active(source)) active.insert(memory.source_name(source));
    }
    LiveSituation seen{drawing::decide(rules, std::move(active)), picture.snapshot.generation};
    seen.fits = fits(instance, picture, seen.situation);
    if (memory.tables().is_whole(picture.snapshot)) return seen;
  }
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
rules::ModelFiles files_of(const wire::Status& status) {
  rules::ModelFiles files;
  const auto from_here = [&](const std::string& file) {  // the daemon may run in another directory
    return watch::path_from_here(file, status.directory);
  };
  for (const auto& file : status.model.files) files.models.push_back(from_here(file));
  if (status.model.application) files.application = from_here(*status.model.application);
  if (files.models.empty()) throw Error("the daemon has no model; give one: arbiter graph MODEL");
  return files;
}

class LivePicture {
 public:
  LivePicture(const GraphOptions& options, watch::Instance& instance)
      : options_(options), instance_(instance), picture_(options) {}

  // False: the model cannot be drawn.
  bool update() {
    LiveSituation now;
    int tries = 0;
    do {
      // Another daemon may count its models from one again.
      const bool is_drawn =
          drawn_of_ == instance_.memory() && drawn_ == instance_.memory()->tables().generation();
      if (!is_drawn && !load()) return false;
      now = look(instance_, picture_.rules());
    } while (now.generation != drawn_ && ++tries < kMostLoads);
    fits_ = now.fits;
    if (!fits_ && is_same_ && !std::exchange(warned_, true)) {
      std::cerr << "arbiter: the daemon decides otherwise than this model does; is it the one in "
                   "force, and unchanged since? (arbiter status, arbiter reload)\n";
    }
    picture_.write(&now.situation);
    return true;
  }
  // Whether the picture is of what the daemon does.
  [[nodiscard]] bool is_true() const { return fits_ && is_same_ && picture_.is_good(); }

 private:
  bool load() {
    const auto memory = instance_.memory();
    const auto in_force = watch::ModelInForce::fetch(instance_);
    if (!options_.files.models.empty()) {
      const rules::ModelTexts given = rules::read_texts(options_.files);
      if (!picture_.load(given)) return false;
      is_same_ =
          !in_force.is_none() && (!in_force.has_texts() || same_texts(given, in_force.texts()));
      if (in_force.is_none()) {
        std::cerr << "arbiter: the daemon has no model in force\n";
      } else if (!is_same_) {
        std::cerr << "arbiter: this is not the text of the model in force, model "
                  << in_force.generation() << "; the daemon may decide otherwise than is shown "
                  << "(arbiter status names its files; arbiter reload has them read again)\n";
      }
    } else if (in_force.has_texts()) {
      if (in_force.texts().models.empty() && !in_force.texts().application) {
        throw Error("the daemon has no model; give one: arbiter graph MODEL");
      }
      if (!picture_.load(in_force.texts())) return false;
    } else if (!picture_.load(rules::read_texts(files_of(instance_.status())))) {
      return false;
    }
    drawn_of_ = memory;
    drawn_ = in_force.generation();
    warned_ = false;
    return true;
  }

  const GraphOptions& options_;
  watch::Instance& instance_;
  Picture picture_;
  std::shared_ptr<const shm::DecisionMemory> drawn_of_;
  std::uint64_t drawn_ = 0;  // the generation of the model that the picture is of
  bool fits_ = false;
  bool is_same_ = true;  // as far as it is known: given is what is in force
  bool warned_ = false;
};

int draw_live(const GraphOptions& options) {
  const auto instance = watch_instance("graph", options.instance);
  LivePicture picture(options, *instance);
  if (!picture.update()) return 1;
  return picture.is_true() ? 0 : 1;
}

// While there is no daemon, what was decided last goes on, and so does the picture of it.
int follow(const GraphOptions& options) {
  const shm::FileDescriptor interrupts = catch_interrupts();
  const auto instance = watch_instance("graph", options.instance);
  LivePicture picture(options, *instance);
  if (!picture.update()) return 1;
  bool is_alone = false;
  std::string said;
  for (shm::Nanoseconds next = shm::monotonic_now();;) {
    next = std::max(next + kFollowPeriod, shm::monotonic_now());
    if (sleep_until(next, interrupts)) return 0;
    instance->update();
    if (is_alone != !instance->has_daemon()) {
      is_alone = !is_alone;
      std::cerr << (is_alone ? "arbiter: the daemon has gone; what it decided last goes on, and is "
                               "drawn on\n"
                             : "arbiter: a daemon is there again\n");
    }
    try {
      if (!picture.update()) return 1;
    } catch (const wire::CallError&) {
      // The daemon has gone before it could be asked for its model: the next one is.
    } catch (const Error& error) {
      if (std::exchange(said, error.what()) == error.what()) continue;
      std::cerr << "arbiter: " << error.what() << "; " << options.output << " stays as it was\n";
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
