#include "evidence/verification.hpp"

#include <algorithm>
#include <utility>

#include "rules/model/quantifiers.hpp"

namespace arbiter::evidence {
namespace {

// T may have changed while a publisher was at work: it took that of a model that was in force
// between its last arrival and this decision.
bool fits_timeout(const Run& run, const Decision& decision, Models& models) {
  const Step& step = decision.arrival();
  const std::uint64_t before =
      decision.step == 0 ? 0 : decision.source->steps[decision.step - 1].generation;
  for (std::uint64_t generation = step.generation;; --generation) {
    const auto judge = models.judge(run, generation);
    if (judge == nullptr) return true;  // nobody knows
    const Nanoseconds timeout = judge->timeout(decision.context->source);
    if (step.word == shm::arrival(step.time, timeout)) return true;
    if (generation <= before || generation == 0) return false;
  }
}

std::string activities_at(const Judge& judge, const LiveDecision& live) {
  const auto& simulation = judge.simulation();
  const auto port = simulation.find_port(*live.port);
  if (!port) return "";
  std::string text;
  const shm::WordList reads = simulation.table().sources_read(*port);
  for (shm::Word i = 0; i < reads.count; ++i) {
    const std::string& source = simulation.source_name(reads[i]);
    const auto history = live.run->sources.find(source);
    text += (text.empty() ? "" : ", ") + source;
    if (history == live.run->sources.end()) {
      text += " not recorded";
      continue;
    }
    const Nanoseconds now = live.decision->arrival().time;
    ActivityWord word = shm::kNeverActive;
    for (const Step& step : history->second.steps) {
      if (step.time <= now) word = step.word;
    }
    text += shm::is_active(word, now) ? " active" : " inactive";
  }
  return text;
}

class Verifier {
 public:
  explicit Verifier(Models& models) : models_(models) {}

  void take(const LiveDecision& live) {
    const auto judge = models_.judge(*live.run, live.decision->arrival().generation);
    if (judge == nullptr) {
      ++result_.without_model;
      return;
    }
    if (live.is_blind) {
      ++result_.blind;
      return;
    }
    Judge::Connection connection{};
    const Permitted permitted = judge->permitted(*live.run, *live.decision, *live.port, connection);
    if (connection == Judge::Connection::none) {
      differ(live, [] { return "the model does not connect the two"; });
    } else if (!permitted.has(live.won)) {
      differ(live, [&] {
        return std::string("the model ") + (live.won ? "discards" : "delivers") +
               " it; by the recording: " + activities_at(*judge, live);
      });
    } else if (!fits_timeout(*live.run, *live.decision, models_)) {
      differ(live, [] { return "its source was made active for another time than the model's T"; });
    } else if (permitted.is_sure()) {
      ++result_.equal;
    } else if (permitted.rests_on_gap) {
      ++result_.behind_gap;
    } else {
      ++result_.overlapped;
    }
  }

  Verification finish() { return std::move(result_); }

 private:
  // For the first alone: to find the activities takes all steps of their sources.
  template <class Text>
  void differ(const LiveDecision& live, const Text& text) {
    ++result_.different;
    if (!result_.first) result_.first = {live, text()};
  }

  Models& models_;
  Verification result_;
};

}  // namespace

bool is_chosen(const Run& run, const std::string& port) {
  return run.ports.empty() ||
         std::any_of(run.ports.begin(), run.ports.end(),
                     [&](const std::string& pattern) { return rules::matches(pattern, port); });
}

void for_each_outcome(const Run& run, const Decision& decision,
                      const std::function<void(const LiveDecision&)>& use) {
  const shm::Masks& masks = decision.masks;
  const auto& ports = decision.context->destinations;
  for (std::size_t i = 0; i < ports.size() && i < shm::kMaxDestinations; ++i) {
    const std::uint64_t bit = std::uint64_t{1} << i;
    const bool won = ((masks.accepted | masks.refused) & bit) != 0;
    const bool is_blind = (masks.blind & bit) != 0;
    const bool was_decided = won || is_blind || (masks.discarded & bit) != 0;
    if (was_decided && is_chosen(run, ports[i])) use({&run, &decision, &ports[i], is_blind, won});
  }
}

void for_each_arrival(const Run& run, const std::function<void(const Decision&)>& use,
                      const recording::Watch& watch) {
  std::uint64_t done = 0;
  for (const Decision& decision : run.decisions) {
    if (watch) watch(done++, run.decisions.size());
    if (decision.arrival().time >= run.start) use(decision);
  }
}

void for_each_decision(const Run& run, const std::function<void(const LiveDecision&)>& use,
                       const recording::Watch& watch) {
  for_each_arrival(
      run, [&](const Decision& decision) { for_each_outcome(run, decision, use); }, watch);
}

Verification verify(const Recorded& recorded, Models& models, const recording::Watch& watch) {
  Verifier verifier(models);
  for (const Run& run : recorded.runs) {
    for_each_decision(
        run, [&](const LiveDecision& live) { verifier.take(live); }, watch);
  }
  return verifier.finish();
}

}  // namespace arbiter::evidence
