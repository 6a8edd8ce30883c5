#include "shm/decision.hpp"

#include <gtest/gtest.h>

#include <functional>
#include <memory>

#include "shm/clock.hpp"
#include "tests/shm/table_builder.hpp"

namespace arbiter::shm {
namespace {

using test::TableBuilder;
using test::TableWords;

constexpr SourceId kA = 0, kB = 1, kC = 2, kD = 3;
constexpr SourceId kSources = 4;
constexpr Nanoseconds kT = 100;

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
    for (SourceId id = 0; id < kSources; ++id) {
      pages_->attach(id, &activities_[id]);
      builder_.timeout(id, kT);
    }
  }

  Atomic<ActivityWord>& word(SourceId id) { return activities_[id].word; }

  Verdict decide(ConnectionIndex connection, ScriptedClock& clock, bool with_own = false) {
    const TableWords words(builder_.words(kSources, 1));
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
  Activity activities_[kSources];
  std::unique_ptr<ActivityPages> pages_ = std::make_unique<ActivityPages>();
};

TEST_F(Decision, AConnectionWithoutARuleLosesAndOneWithoutAConditionWins) {
  builder_.connect({kA, 0, table::kNever, {}, {}}).connect({kB, 0, table::kAlways, {}, {}});
  EXPECT_EQ(decide_at(0, 1), Verdict::kLoses);
  EXPECT_EQ(decide_at(1, 1), Verdict::kWins);
}

TEST_F(Decision, ItsOwnActivityIsTakenAsGivenUnlessItIsAskedFor) {
  builder_.connect({kA, 0, table::kAlways, {}, {}});
  EXPECT_EQ(decide_at(0, 1), Verdict::kWins);
  EXPECT_EQ(decide_at(0, 1, true), Verdict::kLoses);
  word(kA) = arrival(1, kT);
  EXPECT_EQ(decide_at(0, kT, true), Verdict::kWins);
  EXPECT_EQ(decide_at(0, 1 + kT, true), Verdict::kLoses) << "at exactly t + T it is inactive";
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
  const ActivityWord choices[] = {kNeverActive,     arrival(100, kForever), deactivation(100),
                                  arrival(0, kT),   arrival(50, kT),        arrival(100, kT),
                                  arrival(101, kT), arrival(120, kForever), deactivation(130)};
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
  word(kB) = arrival(0, kT);  // ended at 100
  word(kC) = deactivation(100);
  ScriptedClock clock{100, false, 500, 0, [] {}};
  EXPECT_EQ(decide(0, clock), Verdict::kWins);
  EXPECT_EQ(clock.readings, 0);
  word(kC) = arrival(90, kT);  // ends at 190
  EXPECT_EQ(decide(0, clock), Verdict::kWins);
  EXPECT_EQ(clock.readings, 1);
}

// B ended at 200; C was deactivated, or became active, at 300. The clock was read at 150, and then
// we were held up. No moment has seen B and C as a naive reader would put them together.
TEST_F(Decision, AnEndBeforeAndADeactivationAfterAReadingAreNotCombined) {
  builder_.conjunction(kA, 0, {kB}, {kC});
  word(kB) = arrival(100, kT);
  word(kC) = deactivation(300);
  ScriptedClock clock{150, true, 310, 0, [] {}};
  EXPECT_EQ(decide(0, clock), Verdict::kLoses);
}

TEST_F(Decision, AnEndBeforeAndAnEndlessActivityAfterAReadingAreNotCombined) {
  builder_.conjunction(kA, 0, {kB, kC}, {});
  word(kB) = arrival(100, kT);
  word(kC) = arrival(300, kForever);
  ScriptedClock clock{150, true, 310, 0, [] {}};
  EXPECT_EQ(decide(0, clock), Verdict::kLoses);
}

TEST_F(Decision, AnEndBeforeAndAnArrivalAfterAReadingAreNotCombined) {
  builder_.conjunction(kA, 0, {kB, kC}, {});
  word(kB) = arrival(100, kT);
  word(kC) = arrival(300, kT);
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
    activities_[kC].arrive(deactivation(time), arrival(time + 10, kT));
    clock.next = time;
  };
  clock.on_read();
  EXPECT_EQ(decide(0, clock), Verdict::kUnsettled);
  EXPECT_LE(clock.readings, kMaxPictures);
}

TEST_F(Decision, PagesBeyondTheLimitAreNotFound) {
  EXPECT_EQ(pages_->find(kMaxSources), nullptr);
  EXPECT_EQ(pages_->find(kNone), nullptr);
}

}  // namespace
}  // namespace arbiter::shm
