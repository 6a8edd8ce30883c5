#include "shm/decision.hpp"

#include <gtest/gtest.h>

#include <functional>
#include <memory>
#include <random>
#include <vector>

#include "shm/clock.hpp"
#include "tests/shm/table_builder.hpp"

namespace arbiter::shm {
namespace {

using test::TableBuilder;
using test::TableWords;

constexpr SourceId kA = 0, kB = 1, kC = 2, kD = 3;
constexpr SourceId kFour = 4;
constexpr Nanoseconds kShortT = 100;

// A clock whose readings the test writes, and that counts how often it was read.
struct ScriptedClock {
  Nanoseconds last = 0;
  bool fresh = true;
  Nanoseconds next = 0;
  int readings = 0;
  std::function<void()> on_read = [] {};

  [[nodiscard]] Nanoseconds reading() const { return last; }
  [[nodiscard]] bool is_fresh() const { return fresh; }
  void read() {
    on_read();
    ++readings;
    last = next;
    fresh = true;
  }
};

class Decision : public testing::Test {
 protected:
  Decision() {
    for (SourceId id = 0; id < kFour; ++id) {
      pages_->attach(id, &activities_[id]);
      builder_.timeout(id, kShortT);
    }
  }

  Atomic<ActivityWord>& word(SourceId id) { return activities_[id].word; }

  Verdict decide(ConnectionIndex connection, ScriptedClock& clock, bool with_own = false) {
    const TableWords words(builder_.words(kFour, 1));
    const TableView view = words.view();
    Decider decider(view, *pages_, clock);
    const Rule rule = view.rule(connection);
    return with_own ? decider.decide_with_own(rule) : decider.decide(rule);
  }
  Verdict decide_at(ConnectionIndex connection, Nanoseconds now, bool with_own = false) {
    ScriptedClock clock{now, true, now, 0, [] {}};
    return decide(connection, clock, with_own);
  }

  TableBuilder builder_;
  Activity activities_[kFour];
  std::unique_ptr<ActivityPages> pages_ = std::make_unique<ActivityPages>();
};

TEST_F(Decision, AConnectionWithoutARuleLosesAndOneWithoutAConditionWins) {
  builder_.connect({kA, 0, table::kNever, {}, {}}).connect({kB, 0, table::kAlways, {}, {}});
  EXPECT_EQ(decide_at(0, 1), Verdict::kLoses);
  EXPECT_EQ(decide_at(1, 1), Verdict::kWins);
}

// A where B is not, then B, then C where D is not.
TableBuilder& rules_in_order(TableBuilder& builder) {
  constexpr Word t = table::kTrue, f = table::kFalse;
  const std::vector<Word> nodes = {2, 1, f, 0, 2, f, 1, t, 3, 0, f, t};
  builder.conjunction(kA, 0, {}, {kB});
  builder.connect({kB, 0, table::kInOrder, {kB, kA}, nodes, 2, 2});
  return builder.connect({kC, 0, table::kInOrder, {kB, kA, kD}, nodes, 0, 1});
}

TEST_F(Decision, OfRulesInOrderTheFirstThatHoldsWins) {
  rules_in_order(builder_);
  for (unsigned mask = 0; mask < 16; ++mask) {
    const auto is = [&](SourceId id) { return (mask >> id & 1) != 0; };
    for (SourceId id = 0; id < kFour; ++id) {
      word(id) = is(id) ? arrival(1, kForever) : deactivation(1);
    }
    const bool first = !is(kB), third = !is(kD) && !is(kB) && !is(kA);
    const auto verdict = [](bool wins) { return wins ? Verdict::kWins : Verdict::kLoses; };
    EXPECT_EQ(decide_at(0, 2), verdict(first)) << mask;
    EXPECT_EQ(decide_at(1, 2), Verdict::kWins) << mask;
    EXPECT_EQ(decide_at(2, 2), verdict(third)) << mask;
    EXPECT_EQ(decide_at(0, 2, true), verdict(is(kA) && first)) << mask;
    EXPECT_EQ(decide_at(1, 2, true), verdict(is(kB))) << mask;
    EXPECT_EQ(decide_at(2, 2, true), verdict(is(kC) && third)) << mask;
  }
}

TEST_F(Decision, OfRulesInOrderAConnectionTakesItsOwnActivityAsGivenInThoseBeforeIt) {
  rules_in_order(builder_);
  pages_->attach(kB, nullptr);
  word(kA) = arrival(1, kShortT);
  EXPECT_EQ(decide_at(1, 2), Verdict::kWins);
  EXPECT_EQ(decide_at(1, 2, true), Verdict::kBlind);
  EXPECT_EQ(decide_at(2, 2), Verdict::kBlind);
}

TEST_F(Decision, ItsOwnActivityIsTakenAsGivenUnlessItIsAskedFor) {
  builder_.connect({kA, 0, table::kAlways, {}, {}});
  EXPECT_EQ(decide_at(0, 1), Verdict::kWins);
  EXPECT_EQ(decide_at(0, 1, true), Verdict::kLoses);
  word(kA) = arrival(1, kShortT);
  EXPECT_EQ(decide_at(0, kShortT, true), Verdict::kWins);
  EXPECT_EQ(decide_at(0, 1 + kShortT, true), Verdict::kLoses) << "at exactly t + T it is inactive";
}

TEST_F(Decision, AConjunctionHoldsForExactlyTheActivitiesItAsksFor) {
  builder_.conjunction(kA, 0, {kB}, {kC, kD});
  for (unsigned mask = 0; mask < 8; ++mask) {
    for (SourceId id = kB; id <= kD; ++id) {
      word(id) = (mask >> (id - kB) & 1) != 0 ? arrival(1, kForever) : deactivation(1);
    }
    EXPECT_EQ(decide_at(0, 10), mask == 1 ? Verdict::kWins : Verdict::kLoses) << mask;
  }
}

TEST_F(Decision, ADiagramIsWalkedToItsEnd) {
  // (B and C) or D
  constexpr Word t = table::kTrue, f = table::kFalse;
  builder_.connect({kA, 0, table::kDiagram, {kB, kC, kD}, {0, 2, 1, 1, 2, t, 2, f, t}});
  for (unsigned mask = 0; mask < 8; ++mask) {
    for (SourceId id = kB; id <= kD; ++id) {
      word(id) = (mask >> (id - kB) & 1) != 0 ? arrival(1, kForever) : deactivation(1);
    }
    const bool holds = (mask & 3) == 3 || (mask & 4) != 0;
    EXPECT_EQ(decide_at(0, 10), holds ? Verdict::kWins : Verdict::kLoses) << mask;
  }
}

TEST_F(Decision, ASourceWithoutAPageMakesBlindWhatReadsItAndNothingElse) {
  builder_.conjunction(kA, 0, {}, {kB, kC}).connect({kD, 0, table::kAlways, {}, {}});
  pages_->attach(kC, nullptr);
  EXPECT_EQ(decide_at(0, 1), Verdict::kBlind);
  EXPECT_EQ(decide_at(1, 1), Verdict::kWins);
  pages_->attach(kD, nullptr);
  EXPECT_EQ(decide_at(1, 1, true), Verdict::kBlind);
}

TEST_F(Decision, AnOldReadingDecidesAsAFreshOneDoesForAllCombinations) {
  builder_.conjunction(kA, 0, {kB}, {kC});
  const ActivityWord choices[] = {
      kNeverActive,          arrival(100, kForever), deactivation(100),
      arrival(0, kShortT),   arrival(50, kShortT),   arrival(100, kShortT),
      arrival(101, kShortT), arrival(120, kForever), deactivation(130)};
  for (const ActivityWord b : choices) {
    for (const ActivityWord c : choices) {
      word(kB) = b;
      word(kC) = c;
      for (const Nanoseconds now : {150, 199, 200, 201, 250}) {
        const Verdict expected = decide_at(0, now);
        for (const Nanoseconds old : {Nanoseconds{0}, Nanoseconds{99}, Nanoseconds{150}}) {
          ScriptedClock lazy{old, false, now, 0, [] {}};
          EXPECT_EQ(decide(0, lazy), expected) << b << " " << c << " at " << now << " from " << old;
          EXPECT_LE(lazy.readings, 1);
        }
      }
    }
  }
}

TEST_F(Decision, AnOldReadingCostsAClockOnlyWhereActivityMayHaveEndedSince) {
  builder_.conjunction(kA, 0, {}, {kB, kC});
  word(kB) = arrival(0, kShortT);  // ended at 100
  word(kC) = deactivation(100);
  ScriptedClock clock{100, false, 500, 0, [] {}};
  EXPECT_EQ(decide(0, clock), Verdict::kWins);
  EXPECT_EQ(clock.readings, 0);
  word(kC) = arrival(90, kShortT);  // ends at 190
  EXPECT_EQ(decide(0, clock), Verdict::kWins);
  EXPECT_EQ(clock.readings, 1);
}

// B ended at 200; C was deactivated, or became active, at 300. The clock was read at 150, and then
// we were held up. No moment has seen B and C as a naive reader would put them together.
TEST_F(Decision, AnEndBeforeAndADeactivationAfterAReadingAreNotCombined) {
  builder_.conjunction(kA, 0, {kB}, {kC});
  word(kB) = arrival(100, kShortT);
  word(kC) = deactivation(300);
  ScriptedClock clock{150, true, 310, 0, [] {}};
  EXPECT_EQ(decide(0, clock), Verdict::kLoses);
}

TEST_F(Decision, AnEndBeforeAndAnEndlessActivityAfterAReadingAreNotCombined) {
  builder_.conjunction(kA, 0, {kB, kC}, {});
  word(kB) = arrival(100, kShortT);
  word(kC) = arrival(300, kForever);
  ScriptedClock clock{150, true, 310, 0, [] {}};
  EXPECT_EQ(decide(0, clock), Verdict::kLoses);
}

TEST_F(Decision, AnEndBeforeAndAnArrivalAfterAReadingAreNotCombined) {
  builder_.conjunction(kA, 0, {kB, kC}, {});
  word(kB) = arrival(100, kShortT);
  word(kC) = arrival(300, kShortT);
  ScriptedClock clock{150, true, 310, 0, [] {}};
  EXPECT_EQ(decide(0, clock), Verdict::kLoses);
}

TEST_F(Decision, AWordThatAShorterTMakesLookNewerThanAnyReadingIsJudgedAllTheSame) {
  builder_.conjunction(kA, 0, {kB, kC}, {kD});
  builder_.timeout(kB, 1).timeout(kC, 1).timeout(kD, 1);  // they had 1000 when they arrived
  word(kB) = arrival(500, 1000);
  word(kC) = arrival(501, 1000);
  for (const bool fresh : {true, false}) {
    ScriptedClock clock{510, fresh, 510, 0, [] {}};
    EXPECT_EQ(decide(0, clock), Verdict::kWins);
  }
  word(kD) = arrival(502, 1000);
  ScriptedClock clock{510, true, 510, 0, [] {}};
  EXPECT_EQ(decide(0, clock), Verdict::kLoses);
  EXPECT_EQ(decide_at(0, 1502), Verdict::kLoses);
}

TEST_F(Decision, ManyWordsThatLookNewerAreSettledWithinTheBound) {
  constexpr Word kMany = kMaxSourcesPerPort;
  std::vector<Activity> activities(kMany + 1);
  std::vector<SourceId> all;
  for (SourceId id = 1; id <= kMany; ++id) {
    activities[id].word = arrival(500, 1000);
    pages_->attach(id, &activities[id]);
    builder_.timeout(id, 1);
    all.push_back(id);
  }
  TableBuilder builder = builder_;
  builder.conjunction(kA, 0, all, {});
  const TableWords words(builder.words(kMany + 1, 1));
  const TableView view = words.view();
  ScriptedClock clock{510, true, 510, 0, [] {}};
  Decider decider(view, *pages_, clock);
  EXPECT_EQ(decider.decide(view.rule(0)), Verdict::kWins);
}

TEST_F(Decision, ASourceThatChangesAtEveryLookLeavesItUnsettledAfterABoundedTime) {
  builder_.conjunction(kA, 0, {kB, kC}, {});
  word(kB) = arrival(1, kForever);
  Nanoseconds time = 1000;
  ScriptedClock clock{0, true, 0, 0, [] {}};
  clock.on_read = [&] {  // always one step behind an activity that is deactivated in between
    time += 1000;
    activities_[kC].write(arrival(time + 10, kShortT), true, time + 10);
    clock.next = time;
  };
  clock.on_read();
  EXPECT_EQ(decide(0, clock), Verdict::kUnsettled);
  EXPECT_LE(clock.readings, kMaxPictures);
}

// A rule that is kept bound, and one that is decided anew each time.
class KeptBound : public Decision {
 protected:
  void bind(const TableView& view, bool with_own = false) {
    reads_.resize(BoundRule::reads_of(view.rule(0)) + 1);
    rule_.bind(view.rule(0), *pages_, reads_.data(), with_own);
  }
  Verdict decide_bound(const TableView& view, Nanoseconds now) {
    ScriptedClock clock{now, true, now, 0, [] {}};
    return rule_.decide(view, clock);
  }

  std::vector<Read> reads_;
  BoundRule rule_;
};

TEST_F(KeptBound, ItDecidesAsOneThatIsBoundAnewWhateverHappensInBetween) {
  constexpr Word t = table::kTrue, f = table::kFalse;
  const std::function<void(TableBuilder&)> rules[] = {
      [](TableBuilder& builder) {
        builder.conjunction(kA, 0, {kB}, {kC, kD});
      },
      [](TableBuilder& builder) {
        builder.conjunction(kA, 0, {}, {kB, kC, kD});
      },
      [](TableBuilder& builder) {  // (B and C) or D
        builder.connect({kA, 0, table::kDiagram, {kB, kC, kD}, {0, 2, 1, 1, 2, t, 2, f, t}});
      }};
  std::mt19937 random(7);
  const auto draw = [&](unsigned below) { return static_cast<unsigned>(random() % below); };
  for (const auto& make_rule : rules) {
    for (const bool with_own : {false, true}) {
      TableBuilder builder = builder_;
      make_rule(builder);
      const TableWords words(builder.words(kFour, 1));
      const TableView view = words.view();
      bind(view, with_own);
      Nanoseconds now = 1;
      for (int step = 0; step < 20'000; ++step) {
        for (unsigned changes = draw(3); changes != 0; --changes) {
          Activity& activity = activities_[draw(kFour)];
          const Nanoseconds timeout = draw(5) == 0 ? kForever : kShortT;
          if (draw(3) == 0) {
            activity.write(deactivation(now), false, now);
          } else {
            activity.write(arrival(now, timeout), !is_active(activity.word, now), now);
          }
          now += 1 + draw(5);
        }
        now += draw(2) == 0 ? draw(150) : 0;
        // Where a source had another T, a clock that was read later may be asked for.
        ScriptedClock anew{now, true, now, 0, [] {}};
        Decider decider(view, *pages_, anew);
        const Rule rule = view.rule(0);
        const Verdict expected = with_own ? decider.decide_with_own(rule) : decider.decide(rule);
        ASSERT_EQ(decide_bound(view, now), expected) << "step " << step;
      }
    }
  }
}

TEST_F(KeptBound, AnOldReadingServesAsLongAsNothingMayHaveEnded) {
  TableBuilder builder = builder_;
  builder.conjunction(kA, 0, {}, {kB, kC});
  const TableWords words(builder.words(kFour, 1));
  const TableView view = words.view();
  bind(view);
  word(kB) = arrival(0, kShortT);  // ended at 100
  ScriptedClock clock{100, false, 500, 0, [] {}};
  for (int i = 0; i < 3; ++i) EXPECT_EQ(rule_.decide(view, clock), Verdict::kWins);
  EXPECT_EQ(clock.readings, 0);
  word(kC) = arrival(450, kShortT);  // it denies the rule until 550
  EXPECT_EQ(rule_.decide(view, clock), Verdict::kLoses);
  EXPECT_EQ(clock.readings, 1);
  clock = {500, false, 550, 0, [] {}};
  EXPECT_EQ(rule_.decide(view, clock), Verdict::kWins);
  EXPECT_EQ(clock.readings, 1);
}

TEST_F(KeptBound, TheOneThatDeniesItMayChangeItsReason) {
  TableBuilder builder = builder_;
  builder.conjunction(kA, 0, {kB}, {kC});
  const TableWords words(builder.words(kFour, 1));
  const TableView view = words.view();
  bind(view);
  EXPECT_EQ(decide_bound(view, 1), Verdict::kLoses) << "B is not active";
  word(kC) = arrival(10, kShortT);
  word(kB) = arrival(10, kShortT);
  EXPECT_EQ(decide_bound(view, 20), Verdict::kLoses) << "C is";
  word(kC) = deactivation(30);
  EXPECT_EQ(decide_bound(view, 40), Verdict::kWins);
  EXPECT_EQ(decide_bound(view, 10 + kShortT), Verdict::kLoses) << "B has run out";
}

TEST_F(KeptBound, APageThatIsAttachedLaterIsSeenOnceItIsBoundAgain) {
  TableBuilder builder = builder_;
  builder.conjunction(kA, 0, {}, {kB});
  const TableWords words(builder.words(kFour, 1));
  const TableView view = words.view();
  pages_->attach(kB, nullptr);
  bind(view);
  EXPECT_EQ(decide_bound(view, 1), Verdict::kBlind);
  const std::uint64_t before = pages_->changes();
  pages_->attach(kB, &activities_[kB]);
  EXPECT_NE(pages_->changes(), before);
  bind(view);
  EXPECT_EQ(decide_bound(view, 1), Verdict::kWins);
}

TEST_F(Decision, PagesBeyondTheLimitAreNotFound) {
  EXPECT_EQ(pages_->find(kMaxSources), nullptr);
  EXPECT_EQ(pages_->find(kNone), nullptr);
}

}  // namespace
}  // namespace arbiter::shm
