#include "cli/why_recorded.hpp"

#include <algorithm>
#include <iostream>
#include <iterator>
#include <map>
#include <memory>
#include <optional>
#include <utility>
#include <vector>

#include "cli/model_files.hpp"
#include "cli/model_report.hpp"
#include "cli/port_name.hpp"
#include "cli/recording_compile.hpp"
#include "cli/recording_times.hpp"
#include "cli/why_simulated.hpp"
#include "evidence/cues.hpp"
#include "evidence/judge.hpp"
#include "rules/ask/report.hpp"
#include "shm/utf8.hpp"

namespace arbiter::cli {
namespace {

using evidence::Cue;
using evidence::Gap;
using evidence::Run;

// A model, from when it comes into force.
struct Tenure {
  Tenure(std::shared_ptr<const Model> in_force, WhySimulated::Options options)
      : model(std::move(in_force)),
        simulation(model->compiled),
        why(model->rules, simulation, std::move(options)) {}

  const std::shared_ptr<const Model> model;
  rules::Simulation simulation;
  WhySimulated why;
};

class Explaining {
 public:
  // `other`: decides in place of the recorded models; null: they do.
  Explaining(std::shared_ptr<const Model> other, double effort, WhySimulated::Options options)
      : other_(std::move(other)), effort_(effort), options_(std::move(options)) {
    if (other_ != nullptr) judge_.emplace(other_->compiled, true);
    options_.is_in_gap = [this](const std::string& source, shm::Nanoseconds time) {
      const auto of_source = gaps_.find(source);
      if (of_source == gaps_.end()) return false;
      // The last one that begins before.
      const auto next = of_source->second.lower_bound(time);
      return next != of_source->second.begin() && std::prev(next)->second.has(time);
    };
  }

  void explain(const Run& run) {
    words_.clear();
    tenure_.reset();
    is_first_ = true;
    gaps_.clear();
    const std::vector<Gap> gaps = evidence::gaps_of(run);
    for (const Gap& gap : gaps) gaps_[*gap.source].insert_or_assign(gap.from, gap);
    auto gap = gaps.begin();
    for (const Cue& cue : cues_of(run)) {
      if (!std::cout) return;  // nobody reads it
      for (; gap != gaps.end() && gap->from < cue.time; ++gap) {
        if (tenure_ == nullptr) continue;
        tenure_->why.lose(*gap->source, gap->events, gap->from, gap->to, std::cout);
      }
      if (cue.time >= options_.to) break;
      if (cue.model != nullptr) {
        put_in_force(*cue.model, cue.time);
      } else {
        take(run, cue);
      }
    }
    if (tenure_ == nullptr) return;
    tenure_->why.end(run.end, std::cout);
    has_told_ = has_told_ || tenure_->why.has_told();
  }

  // Throws std::runtime_error where no model had the port that is asked about.
  void require_port() const {
    if (has_port_ || without_port_ == nullptr) return;
    cli::require_port(without_port_->rules, options_.port, WhySimulated::kWhyOption);
  }
  // Whether there was anything to tell.
  [[nodiscard]] bool has_told() const { return has_told_; }

 private:
  void put_in_force(const evidence::ModelChange& change, shm::Nanoseconds time) {
    if (other_ != nullptr && tenure_ != nullptr) return;
    const auto last = std::move(tenure_);
    tenure_ = tenure_of(change, time);
    if (last != nullptr) {
      last->why.end_by_model(
          change, time, [this](const std::string& port) { return has_winner(port); }, std::cout);
      has_told_ = has_told_ || last->why.has_told();
    }
    if (tenure_ != nullptr) tenure_->why.begin(std::cout);
  }

  // With what was active. Null: nothing is told of what it decided.
  std::unique_ptr<Tenure> tenure_of(const evidence::ModelChange& change, shm::Nanoseconds time) {
    auto model = model_of(change, time);
    if (model == nullptr) return nullptr;
    // Another model of the recording may have it.
    if (!options_.port.empty() && !has_port(*model)) {
      without_port_ = std::move(model);
      if (other_ == nullptr) {
        std::cerr << "arbiter: model " << change.generation << " has no input port "
                  << options_.port << ": what it decided is left out\n";
      }
      return nullptr;
    }
    has_port_ = true;
    auto tenure = std::make_unique<Tenure>(std::move(model), options_);
    rules::Simulation& simulation = tenure->simulation;
    for (const auto& [source, word] : words_) {
      if (simulation.knows(source)) simulation.set_activity(simulation.source_id(source), word);
    }
    simulation.advance_to(time);
    return tenure;
  }

  // Null: there is none, or it is not known.
  std::shared_ptr<const Model> model_of(const evidence::ModelChange& change,
                                        shm::Nanoseconds time) {
    if (other_ != nullptr) return other_;
    if (change.generation == 0) return nullptr;
    if (!change.has_texts) {
      std::cerr << "arbiter: the texts of model " << change.generation
                << " are not in the recording: what it decided is left out\n";
      return nullptr;
    }
    auto model = std::make_shared<const Model>(
        compile_recorded(evidence::texts_of(change), effort_, rules::Keep::kProvenance));
    const bool is_first = std::exchange(is_first_, false);
    if (!is_first) {
      std::cerr << "arbiter: " << options_.time(time) << ", " << news_text(change) << '\n';
    }
    return model;
  }

  [[nodiscard]] bool has_winner(const std::string& port) const {
    if (tenure_ == nullptr) return false;
    const auto found = tenure_->simulation.find_port(port);
    return found && tenure_->simulation.table().is_arbitrated(*found) &&
           tenure_->simulation.winner_at(*found) != shm::kNone;
  }

  [[nodiscard]] bool has_port(const Model& model) const {
    const auto& ports = model.compiled.ports;
    return std::any_of(ports.begin(), ports.end(),
                       [&](const auto& each) { return each.port == options_.port; });
  }

  void take(const Run& run, const Cue& cue) {
    const std::string& source = *cue.source;
    const auto word = judge_ ? judge_->word_of(source, *cue.step, run.start) : cue.step->word;
    words_[source] = word;
    if (tenure_ == nullptr) return;
    if (cue.step->kind != evidence::Step::Kind::arrival) {
      tenure_->why.find(source, word, cue.time, std::cout);
      return;
    }
    rules::TraceEvent arrival;
    arrival.at = cue.time;
    arrival.source = source;
    tenure_->why.step(arrival, std::cout);
  }

  const std::shared_ptr<const Model> other_;
  const double effort_;
  WhySimulated::Options options_;
  std::optional<evidence::Judge> judge_;  // of the other model
  std::map<std::string, shm::ActivityWord> words_;
  // What the recorder missed, by source and by when it begins.
  std::map<std::string, std::map<shm::Nanoseconds, Gap>> gaps_;
  std::unique_ptr<Tenure> tenure_;
  bool is_first_ = true;  // no model of this run has come into force
  bool has_told_ = false;
  std::shared_ptr<const Model> without_port_;  // one that does not have the port asked about
  bool has_port_ = false;                      // another one does
};

}  // namespace

int explain_recording(const SimulateRecordingOptions& options, const std::string& port) {
  const auto recorded = load_for_simulation(options.recording, options.part);
  warn_of_missed(recorded);
  std::shared_ptr<const Model> other;
  if (!options.other.models.empty()) {
    rules::Diagnostics diagnostics;
    auto model = load_model(options.other, diagnostics, options.effort, rules::Keep::kProvenance);
    rules::write_text(std::cerr, diagnostics);
    if (!model) return 1;
    other = std::make_shared<const Model>(std::move(*model));
  }
  const auto clock = [&](shm::Nanoseconds at) {
    return clock_text(at + recorded.about.wall_offset);
  };
  WhySimulated::Options told;
  told.port = port;
  told.json = options.json;
  told.clock = clock;
  told.time = [&](shm::Nanoseconds at) {
    return clock(at) + " (" + since_first(recorded, at) + ")";
  };
  told.to = recorded.runs.back().until;
  if (!options.at.empty()) {
    const auto span = read_moment(options.at, time_of(recorded));
    told.from = span.from;
    told.to = span.to;
  }
  Explaining explaining(std::move(other), options.effort, std::move(told));
  for (const Run& run : recorded.runs) explaining.explain(run);
  explaining.require_port();
  const bool is_all = options.at.empty() && options.part.is_all();
  if (!is_all && !options.json && !explaining.has_told()) {
    std::cout << "nobody won "
              << (options.at.empty() ? "in that time" : "at " + shm::printable(options.at))
              << ", and nothing happened\n";
  }
  return 0;
}

}  // namespace arbiter::cli
