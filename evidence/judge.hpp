// Whether the rules decide an arrival as it was decided live.
//
// What a recording knows of an arrival, or a deactivation, is when the publisher read the clock,
// and when the recorder had been told of it. In between it took effect: the activity was written,
// and then the pictures were taken by which it was decided at its destinations. So
//
//  - at any moment a source may be in one of several states: as its last step has left it that was
//    seen before, or as one of those has that had begun by then;
//  - a decision may have been taken at any moment between its arrival's time and its being seen.
//
// The outcomes that SEMANTICS permits ("each takes effect at one instant between its call and its
// return") are among those of all these moments and states. Where all are the same, the decision is
// sure, and the live one must be that. Where they are not, the arrival *overlapped* with a change
// of activity that its rule depends on, and the live outcome must be one of them. Nothing is
// guessed: the interval is what the recorder has read off the clock. It is as long as its polling
// period, and only arrivals beside a change of activity can be overlapped at all; one that merely
// renews an activity changes nothing.
//
// An activity ends by time alone. A decision reads the clock once, which gives the arrival's time;
// again only where it saw something that was written later (shm/decision.hpp). So an end is
// uncertain only where such a step may have been seen.
#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "evidence/recorded.hpp"
#include "rules/explain/simulation.hpp"
#include "rules/prove/compile.hpp"
#include "shm/decision_table.hpp"

namespace arbiter::evidence {

// What may have become of an arrival at one input port.
struct Permitted {
  bool wins = false;
  bool loses = false;
  bool rests_on_gap = false;  // more than one only because something is not known

  [[nodiscard]] bool is_sure() const { return wins != loses; }
  [[nodiscard]] bool has(bool won) const { return won ? wins : loses; }
};

// Where several sources that a rule reads may each be active or not, it tries all combinations of
// so many; of more, it permits both outcomes.
inline constexpr std::size_t kMostUncertain = 12;
// Where a source may have taken more steps than so many before a decision, it permits both, too.
inline constexpr std::size_t kMostSteps = 4096;

class Judge {
 public:
  // `with_timeouts`: activities last as long as this model says, and not as was recorded: for what
  // would have happened under another.
  Judge(const rules::CompiledModel& model, bool with_timeouts);

  [[nodiscard]] const rules::Simulation& simulation() const { return simulation_; }
  // T of a source.
  [[nodiscard]] Nanoseconds timeout(const std::string& source) const;
  // What an activity is like after a step; of steps that were before `start`, as recorded.
  [[nodiscard]] ActivityWord word_of(const std::string& source, const Step& step,
                                     Nanoseconds start) const;

  [[nodiscard]] bool connects(const std::string& source, const std::string& port) const;

  enum class Connection : std::uint8_t { there, none };
  // At an input port that the model connects the source with; else nothing can win.
  Permitted permitted(const Run& run, const Decision& decision, const std::string& port,
                      Connection& connection);

 private:
  // A source that the rule reads, and what it may be like.
  struct Read {
    shm::SourceId id = shm::kNone;
    const std::string* name = nullptr;
    const SourceHistory* history = nullptr;
    bool is_unknown = false;
    bool may_be_active = false;
    bool may_be_inactive = false;
  };

  // The readings of the clock by which activities may have been judged.
  struct Reading {
    Nanoseconds first = 0;
    Nanoseconds last = 0;
  };

  void look(const Run& run, Read& read, Nanoseconds from, Nanoseconds to, bool& has_later) const;
  void judge_activity(const Run& run, Read& read, Nanoseconds from, Nanoseconds to,
                      const Reading& reading) const;
  static void add_moments(const SourceHistory& history, Nanoseconds from, Nanoseconds to,
                          std::vector<Nanoseconds>& moments);
  void evaluate(const shm::Rule& rule, const std::vector<Read>& reads, Permitted& permitted);

  rules::Simulation simulation_;
  const bool with_timeouts_;
};

}  // namespace arbiter::evidence
