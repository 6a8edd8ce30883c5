// A decision sees one picture of activities that change meanwhile (shm/decision.hpp).
#include <memory>

#include "shm/clock.hpp"
#include "shm/decision.hpp"
#include "tests/explore/case.hpp"
#include "tests/explore/components.hpp"
#include "tests/explore/kernel.hpp"

namespace arbiter::explore::decision_cases {
namespace {

constexpr shm::Nanoseconds kNow = 1000;

// Sources without an end, a table, and each source's publisher.
struct World {
  explicit World(const test::TableBuilder& builder)
      : words(builder.words(kSources, 1)), view(words.view()) {
    for (SourceId id = 0; id < kSources; ++id) pages->attach(id, &activities[id]);
  }
  // `at`: when the first of its events may be; not before what the clock shows, where it is read.
  void reset(shm::Nanoseconds at = 1) {
    time = at;
    for (SourceId id = 0; id < kSources; ++id) {
      activities[id].word.store(shm::kNeverActive);
      activities[id].breaks.store(0);
      own[id] = shm::kNeverActive;
    }
  }

  // As OutputCore::stamped(), for each source by its one publisher.
  void stamp_fence() { shm::full_fence(); }  // (a)
  void arrive(SourceId id, shm::Nanoseconds timeout = shm::kForever) {
    const shm::ActivityWord next = shm::arrival(++time, timeout);
    activities[id].write(next, !shm::is_active(own[id], time), time);
    own[id] = next;
    stamp_fence();
  }
  void deactivate(SourceId id) {
    const shm::ActivityWord next = shm::deactivation(++time);
    activities[id].write(next, false, time);
    own[id] = next;
    stamp_fence();
  }
  bool wins(SourceId id) {
    shm::FixedClock clock(kNow);
    shm::Decider decider(view, *pages, clock);
    return decider.decide(view.rule(view.find(id, 0))) == shm::Verdict::kWins;
  }
  test::TableWords words;
  shm::TableView view;
  std::unique_ptr<shm::ActivityPages> pages = std::make_unique<shm::ActivityPages>();
  shm::Activity activities[kSources];
  shm::ActivityWord own[kSources];
  shm::Nanoseconds time = 1;
};

// A and not B and not C. B is active; C arrives, then B is deactivated: never are both inactive.
void move_activity_of(const Explore& explore, const test::TableBuilder& builder) {
  World world(builder);
  explore([&](Execution& execution) {
    world.reset();
    world.arrive(kB);
    execution.thread([&] {
      world.arrive(kC);
      world.deactivate(kB);
    });
    execution.thread([&] { require(!world.wins(kA), "two moments were mixed"); });
  });
}
const Register kMoved("MomentsAreNotMixedWhereActivityMovesFromOneToAnother", {8, 8},
                      [](const Explore& explore) {
                        move_activity_of(explore, forever().conjunction(kA, 0, {}, {kC, kB}));
                      });

// The same where B and C have the two rules before A's, which are tried one after the other.
const Register kMovedInOrder(
    "MomentsAreNotMixedInRulesThatAreTriedInOrder", {8, 8}, [](const Explore& explore) {
      constexpr shm::Word kTrue = shm::table::kTrue, kFalse = shm::table::kFalse;
      move_activity_of(
          explore,
          forever().connect(
              {kA, 0, shm::table::kInOrder, {kC, kB}, {0, 1, kFalse, 1, kTrue, kFalse}, 0, 0}));
    });

// The same by a rule that is kept bound: what it saw last counts too, and was before all this.
void move_activity_under_a_bound_rule(const Explore& explore) {
  World world(forever().conjunction(kA, 0, {}, {kC, kB}));
  shm::Read reads[2];
  shm::BoundRule rule;
  const auto wins = [&] {
    shm::FixedClock clock(kNow);
    return rule.decide(world.view, clock) == shm::Verdict::kWins;
  };
  explore([&](Execution& execution) {
    world.reset();
    world.arrive(kB);
    rule.bind(world.view.rule(0), *world.pages, reads, false);
    require(!wins(), "B is active");
    execution.thread([&] {
      world.arrive(kC);
      world.deactivate(kB);
      world.arrive(kB);
      world.deactivate(kC);
    });
    execution.thread([&] {
      for (int i = 0; i < 2; ++i) require(!wins(), "two moments were mixed");
    });
  });
}
const Register kMovedUnderABoundRule("ARuleThatIsKeptBoundMixesNoMoments", {6, 4},
                                     move_activity_under_a_bound_rule);

// B and C, of which one is active at a time; each comes back after a break.
void break_off(const Explore& explore) {
  World world(forever().conjunction(kA, 0, {kB, kC}, {}));
  explore([&](Execution& execution) {
    world.reset();
    world.arrive(kB);
    execution.thread([&] {
      world.deactivate(kB);
      world.arrive(kC);
      world.deactivate(kC);
      world.arrive(kB);
      world.deactivate(kB);
      world.arrive(kC);
    });
    execution.thread([&] { require(!world.wins(kA), "two moments were mixed"); });
  });
}
const Register kBroken("AnActivityThatWasBrokenOffDoesNotCountAsRenewed", {6, 0}, break_off);
const Register kBrokenAndOld(
    "AnActivityThatWasBrokenOffDoesNotCountAsRenewedThoughOldValuesAreSeen", {2, 5}, break_off);

// B's activity had no end until a model came under which it has; so it runs out. C arrives in that
// gap, and A is deactivated before B comes back: never are all three active.
void run_out_under_another_model(const Explore& explore) {
  constexpr shm::Nanoseconds kT = 10;
  World world(test::TableBuilder()
                  .timeout(kA, shm::kForever)
                  .timeout(kB, kT)
                  .timeout(kC, shm::kForever)
                  .conjunction(kA, 0, {kB, kC}, {}));
  const shm::Nanoseconds start = virtual_time();
  explore([&](Execution& execution) {
    world.reset(start);
    set_virtual_time(start);
    world.arrive(kA);
    world.arrive(kB);
    execution.thread([&] {
      world.arrive(kB, kT);
      set_virtual_time(world.time += kT);
      world.arrive(kC);
      world.deactivate(kA);
      world.arrive(kB, kT);
    });
    execution.thread([&] {
      shm::DecisionClock clock(0, false);
      shm::Decider decider(world.view, *world.pages, clock);
      require(decider.decide_with_own(world.view.rule(0)) != shm::Verdict::kWins,
              "two moments were mixed");
    });
  });
}
const Register kRunOut("AnActivityThatRanOutUnderAnotherModelDoesNotCountAsRenewed", {6, 4},
                       run_out_under_another_model);

// B ends, and C has arrived before that: never are both inactive. The clock says that B has ended
// only after C was looked at.
void end_while_it_is_looked_at(const Explore& explore) {
  World world(forever().timeout(kB, 100).conjunction(kA, 0, {}, {kC, kB}));
  shm::Read reads[2];
  shm::BoundRule rule;
  const shm::Nanoseconds start = virtual_time();
  explore([&](Execution& execution) {
    world.reset(start);
    set_virtual_time(start);
    world.arrive(kB, 100);
    rule.bind(world.view.rule(0), *world.pages, reads, false);
    shm::DecisionClock before(0, false);
    require(rule.decide(world.view, before) == shm::Verdict::kLoses, "B is active");
    execution.thread([&] {
      world.arrive(kC);
      set_virtual_time(start + 101);
    });
    execution.thread([&, last = before.reading()] {
      shm::DecisionClock clock(last, false);
      require(rule.decide(world.view, clock) != shm::Verdict::kWins, "two moments were mixed");
    });
  });
}
const Register kEnds("AnActivityThatEndsDuringADecisionIsNotCombinedWithWhatWasBefore", {8, 0},
                     end_while_it_is_looked_at);

}  // namespace
}  // namespace arbiter::explore::decision_cases
