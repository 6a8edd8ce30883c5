// Since when a winner wins: what is said of the past, against the past.
#include "rules/explain/tenure.hpp"

#include <gtest/gtest.h>

#include <map>
#include <optional>
#include <random>
#include <string>
#include <vector>

#include "rules/explain/change.hpp"
#include "rules/explain/simulation.hpp"
#include "rules/prove/compile.hpp"
#include "tests/rules/rules_by_hand.hpp"
#include "tests/support/live_table.hpp"

namespace arbiter::test {
namespace {

using shm::Nanoseconds;

class Past {
 public:
  explicit Past(const rules::RuleSet& rules) : compiled_(compile(rules)), simulation_(compiled_) {}

  void happens(Nanoseconds at, rules::TraceKind kind, const std::string& source = {}) {
    live_until(at);
    rules::TraceEvent event;
    event.at = at;
    event.kind = kind;
    event.source = source;
    const shm::SourceId id = simulation_.source_id(source);
    const bool was_active = shm::is_active(simulation_.activity(id), at);
    shm::Activity& activity = activities_[id];
    static_cast<void>(simulation_.step(event));
    const bool is_arrival = kind == rules::TraceKind::kArrival;
    if (is_arrival) {
      activity.write(simulation_.activity(id), !was_active, at);
    } else {
      activity.deactivate(at);
    }
    winners_[static_cast<std::size_t>(at)] = winner();  // after all that happens at this time
  }
  void arrives(Nanoseconds at, const std::string& source) {
    happens(at, rules::TraceKind::kArrival, source);
  }
  void live_until(Nanoseconds time) {
    for (; static_cast<Nanoseconds>(winners_.size()) <= time;) {
      simulation_.advance_to(static_cast<Nanoseconds>(winners_.size()));
      winners_.push_back(winner());
    }
  }

  [[nodiscard]] rules::Tenure tenure(Nanoseconds model_since = 0) const {
    return rules::tenure_of(simulation_.table(), 0, winner(),
                            {simulation_.now(), model_since, [this](shm::SourceId source) {
                               return simulation_.activity(source);
                             }});
  }
  // The same, where publishers have noted when their activities began.
  [[nodiscard]] rules::Tenure tenure_with_beginnings() const {
    const auto word = [this](shm::SourceId source) { return simulation_.activity(source); };
    const auto began = [this, word](shm::SourceId source) -> std::optional<Nanoseconds> {
      const auto noted = activities_.find(source);
      if (noted == activities_.end()) return std::nullopt;
      const auto known =
          shm::beginning_of(word(source), noted->second.began.load(), simulation_.now());
      return known < 0 ? std::nullopt : std::optional(known);
    };
    return rules::tenure_of(simulation_.table(), 0, winner(),
                            {simulation_.now(), 0, word, {}, began});
  }
  // The same, of sources whose last arrivals came under another T, no later than `arrived_by`.
  [[nodiscard]] rules::Tenure tenure_after_change(Nanoseconds arrived_by) const {
    return rules::tenure_of(simulation_.table(), 0, winner(),
                            {simulation_.now(), 0,
                             [this](shm::SourceId source) { return simulation_.activity(source); },
                             [arrived_by](shm::SourceId) { return std::optional(arrived_by); }});
  }
  [[nodiscard]] shm::SourceId winner() const { return simulation_.winner_at(0); }
  [[nodiscard]] shm::SourceId winner_at(Nanoseconds time) const {
    return winners_.at(static_cast<std::size_t>(time));
  }
  [[nodiscard]] shm::SourceId id(const std::string& source) const {
    return simulation_.source_id(source);
  }

 private:
  static rules::CompiledModel compile(const rules::RuleSet& rules) {
    rules::Diagnostics diagnostics;
    auto model = rules::compile(rules, diagnostics);
    EXPECT_FALSE(diagnostics.has_errors());
    return model;
  }

  const rules::CompiledModel compiled_;
  rules::Simulation simulation_;
  std::vector<shm::SourceId> winners_;  // by time
  std::map<shm::SourceId, shm::Activity> activities_;
};

// T: 20, but /stop for ever.
rules::RuleSet model() {
  RulesByHand rules;
  rules.port("/p", {{"/low", all_of({inactive("/high"), inactive("/stop")})},
                    {"/high", any_of({inactive("/veto"), active("/force")})}});
  for (const auto* source : {"/low", "/high", "/veto", "/force"}) rules.timeout(source, 20);
  rules.timeout("/stop", shm::kForever);
  return rules;
}

TEST(Tenure, IsExactWhereTheEndOfAnActivityMadeTheWinner) {
  Past past(model());
  past.arrives(10, "/high");
  past.arrives(25, "/low");
  past.live_until(40);
  const auto tenure = past.tenure();
  EXPECT_EQ(past.winner(), past.id("/low"));
  EXPECT_TRUE(tenure.is_exact());
  EXPECT_EQ(tenure.at_least, 30);
  EXPECT_EQ(tenure.changed, std::vector<shm::SourceId>{past.id("/high")});
}

TEST(Tenure, IsBoundedWhereTheWinnersOwnBeginningIsNotKnown) {
  Past past(model());
  past.arrives(10, "/high");
  past.arrives(25, "/low");
  past.arrives(38, "/low");
  past.live_until(40);
  const auto tenure = past.tenure();
  EXPECT_FALSE(tenure.is_exact());
  EXPECT_EQ(tenure.at_least, 38);
  EXPECT_EQ(tenure.not_before, 30);
}

TEST(Tenure, IsExactWhereTheWinnerHasNotedWhenItBegan) {
  Past past(model());
  past.arrives(10, "/high");
  past.arrives(35, "/low");
  past.arrives(45, "/low");
  past.arrives(60, "/low");
  past.live_until(70);
  EXPECT_EQ(past.tenure().at_least, 60);
  const auto tenure = past.tenure_with_beginnings();
  EXPECT_TRUE(tenure.is_exact());
  EXPECT_EQ(tenure.at_least, 35);
  EXPECT_EQ(tenure.changed, std::vector<shm::SourceId>{past.id("/low")});
}

TEST(Tenure, OfAPortWhereNothingEverHappenedIsForEver) {
  Past past(model());
  past.live_until(40);
  EXPECT_EQ(past.winner(), shm::kNone);
  EXPECT_EQ(past.tenure().at_least, 0);
  EXPECT_FALSE(past.tenure().not_before);
}

TEST(Tenure, GoesNoFurtherBackThanTheModel) {
  Past past(model());
  past.arrives(10, "/high");
  past.arrives(25, "/low");
  past.live_until(40);
  const auto tenure = past.tenure(35);
  EXPECT_EQ(tenure.at_least, 35);
  EXPECT_FALSE(tenure.not_before);
}

TEST(Tenure, OfASourceThatArrivedUnderAnotherTGoesBackToWhenItDidAtTheLatest) {
  Past past(model());
  past.arrives(38, "/low");  // by the T of now
  past.live_until(40);
  EXPECT_EQ(past.tenure_after_change(15).at_least, 15);
  EXPECT_EQ(past.tenure_after_change(90).at_least, 40) << "it cannot have arrived later than now";
}

// Of 300 pasts, without and with noted beginnings.
TEST(Tenure, NeverSaysOfThePastWhatWasNotSo) {
  const std::vector<std::string> sources = {"/low", "/high", "/veto", "/force", "/stop"};
  std::mt19937 random(5);
  std::map<bool, int> exact, bounded, open;
  for (int run = 0; run < 300; ++run) {
    Past past(model());
    Nanoseconds at = 1;
    for (int event = 0; event < 30; ++event) {
      at += 1 + static_cast<Nanoseconds>(random() % 12);
      const auto& source = sources[random() % sources.size()];
      past.happens(at,
                   random() % (source == "/stop" ? 2 : 8) == 0 ? rules::TraceKind::kDeactivation
                                                               : rules::TraceKind::kArrival,
                   source);
    }
    at += static_cast<Nanoseconds>(random() % 30);
    past.live_until(at);
    for (const bool has_beginnings : {false, true}) {
      const auto tenure = has_beginnings ? past.tenure_with_beginnings() : past.tenure();
      for (Nanoseconds time = tenure.at_least; time <= at; ++time) {
        ASSERT_EQ(past.winner_at(time), past.winner()) << "run " << run << " at " << time;
      }
      ++(tenure.is_exact() ? exact : tenure.not_before ? bounded : open)[has_beginnings];
      if (!tenure.not_before) continue;
      ASSERT_LE(*tenure.not_before, tenure.at_least);
      ASSERT_NE(past.winner_at(*tenure.not_before - 1), past.winner()) << "run " << run;
      ASSERT_FALSE(tenure.changed.empty());
    }
  }
  EXPECT_GT(exact[false], 30);
  EXPECT_GT(bounded[false], 30);
  EXPECT_GT(open[false], 5);
  EXPECT_GT(exact[true], exact[false] * 3 / 2);
}

// Diagrams with unknown sources, against all ways in which they can be known.
TEST(Tenure, EvaluatesRulesWithWhatIsKnown) {
  rules::RuleSet rules = RulesByHand().port(
      "/p", {{"/s", binary(Operator::kXor, active("/a"), any_of({active("/b"), inactive("/c")}))}});
  rules::Diagnostics diagnostics;
  const auto compiled = rules::compile(rules, diagnostics);
  const rules::Simulation simulation(compiled);
  const shm::Rule rule = simulation.table().rule(0);
  using rules::Activation;
  const std::vector<std::string> names = {"/a", "/b", "/c", "/s"};
  for (int state = 0; state < 81; ++state) {
    std::map<shm::SourceId, Activation> known;
    for (int i = 0, rest = state; i < 4; ++i, rest /= 3) {
      known[simulation.source_id(names[static_cast<std::size_t>(i)])] =
          static_cast<Activation>(rest % 3);
    }
    bool can_hold = false, can_fail = false;
    for (const auto& active : subsets(names)) {
      bool agrees = true;
      for (const auto& name : names) {
        const Activation each = known[simulation.source_id(name)];
        if (each == Activation::kUnknown) continue;
        agrees = agrees && (each == Activation::kActive) == active.contains(name);
      }
      if (!agrees) continue;
      const bool holds = active.contains("/s") &&
                         active.contains("/a") != (active.contains("/b") || !active.contains("/c"));
      (holds ? can_hold : can_fail) = true;
    }
    const Activation expected = can_hold && can_fail ? Activation::kUnknown
                                : can_hold           ? Activation::kActive
                                                     : Activation::kInactive;
    EXPECT_EQ(rules::evaluate(rule, [&](shm::SourceId source) { return known.at(source); }),
              expected)
        << state;
  }
}

TEST(CausesOfChange, AreTheOneSourceThatWouldHaveDoneOrAllThatChanged) {
  rules::Diagnostics diagnostics;
  const auto compiled = rules::compile(model(), diagnostics);
  const rules::Simulation simulation(compiled);
  const auto causes = [&](const Active& before, const Active& after) {
    const auto picture = [&](const Active& active) {
      return [&](shm::SourceId source) { return active.contains(simulation.source_name(source)); };
    };
    Active names;
    for (const auto source :
         rules::causes_of_change(simulation.table(), 0, picture(before), picture(after))) {
      names.insert(simulation.source_name(source));
    }
    return names;
  };
  EXPECT_EQ(causes({"/low"}, {"/low", "/high"}), Active{"/high"});
  EXPECT_EQ(causes({"/low"}, {"/low", "/high", "/force"}), Active{"/high"});
  EXPECT_EQ(causes({"/low", "/veto"}, {"/low", "/high"}), (Active{"/high", "/veto"}));
}

}  // namespace
}  // namespace arbiter::test
