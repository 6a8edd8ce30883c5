#include "cli/graph_live.hpp"

#include <algorithm>
#include <cstdint>
#include <iostream>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <utility>

#include <nlohmann/json.hpp>

#include "cli/live.hpp"
#include "cli/model_in_force.hpp"
#include "shm/clock.hpp"

namespace arbiter::cli {
namespace {

using drawing::Situation;
using nlohmann::json;

constexpr shm::Nanoseconds kFollowPeriod = 100'000'000;

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
    if (drawn_ != generation_of(now)) {
      if (!load(*now.model)) return false;
      now = look(*node_, picture_.rules());
    }
    fits_ = now.fits;
    if (!fits_ && is_same_ && generation_of(now) == drawn_ && !std::exchange(warned_, true)) {
      std::cerr << "arbiter: the daemon decides otherwise than this model does; is it the one in "
                   "force, and unchanged since? (arbiter status, arbiter reload)\n";
    }
    picture_.write(&now.situation);
    return true;
  }
  // Whether the picture is of what the daemon does.
  [[nodiscard]] bool is_true() const { return fits_ && is_same_ && picture_.is_good(); }
  // Another daemon may count its models from one again.
  void forget_model() { drawn_.reset(); }

 private:
  static std::uint64_t generation_of(const LiveSituation& now) {
    return now.model->at("generation").get<std::uint64_t>();
  }

  bool load(const json& model) {
    const ModelInForce in_force = ModelInForce::fetch(*node_);
    const std::string title = in_force.text() + (in_force.is_none() ? "" : " in force") +
                              ", instance " + node_->instance();
    if (!options_.files.models.empty()) {
      const rules::ModelTexts given = rules::read_texts(options_.files);
      if (!picture_.load(given, title)) return false;
      warn_if_other(given, in_force);
    } else if (in_force.has_texts()) {
      if (in_force.texts().models.empty() && !in_force.texts().application) {
        throw Error("the daemon has no model; give one: arbiter graph MODEL");
      }
      if (!picture_.load(in_force.texts(), title)) return false;
    } else {
      if (!picture_.load(rules::read_texts(files_of(model)), title)) return false;
    }
    drawn_ = in_force.generation();
    warned_ = false;
    return true;
  }

  void warn_if_other(const rules::ModelTexts& given, const ModelInForce& in_force) {
    is_same_ =
        !in_force.is_none() && (!in_force.has_texts() || same_texts(given, in_force.texts()));
    if (in_force.is_none()) {
      std::cerr << "arbiter: the daemon has no model in force\n";
    } else if (!is_same_) {
      std::cerr << "arbiter: this is not the text of the model in force, model "
                << in_force.generation() << "; the daemon may decide otherwise than is shown "
                << "(arbiter status names its files; arbiter reload has them read again)\n";
    }
  }

  const GraphOptions& options_;
  const std::shared_ptr<detail::NodeCore> node_;
  Picture picture_;
  std::optional<std::uint64_t> drawn_;  // the generation of the model that the picture is of
  bool fits_ = false;
  bool is_same_ = true;  // as far as it is known: given is what is in force
  bool warned_ = false;
};

}  // namespace

int draw_live(const GraphOptions& options) {
  const auto node = connect("graph", options.instance);
  LivePicture picture(options, node);
  if (!picture.update()) return 1;
  return picture.is_true() ? 0 : 1;
}

int draw_and_follow(const GraphOptions& options) {
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

}  // namespace arbiter::cli
