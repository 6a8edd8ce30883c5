// Decisions while activity changes (shm/decision.hpp), and what fence (a) gives.
#include "shm/decision.hpp"

#include <gtest/gtest.h>

#include <memory>

#include "shm/clock.hpp"
#include "tests/explore/scenario.hpp"
#include "tests/shm/table_builder.hpp"

namespace arbiter::explore {
namespace {

using shm::SourceId;
constexpr SourceId kA = 0, kB = 1, kC = 2, kSources = 3;
constexpr shm::Nanoseconds kNow = 1000;

// Sources without an end, a table, and each source's publisher.
struct World {
  explicit World(const test::TableBuilder& builder)
      : words(builder.words(kSources, 1)), view(words.view()) {
    for (SourceId id = 0; id < kSources; ++id) pages->attach(id, &activities[id]);
  }
  void reset() {
    time = 1;
    for (SourceId id = 0; id < kSources; ++id) {
      activities[id].word.store(shm::kNeverActive);
      activities[id].breaks.store(0);
      own[id] = shm::kNeverActive;
      accepted[id] = false;
    }
    returned.store(0);
    entry.store(0);
  }

  // As OutputCore::stamp(), for each source by its one publisher.
  void stamp_fence() { shm::full_fence(); }  // (a)
  void arrive(SourceId id) {
    const shm::ActivityWord next = shm::arrival(++time, shm::kForever);
    activities[id].arrive(own[id], next);
    own[id] = next;
    stamp_fence();
  }
  void deactivate(SourceId id) {
    own[id] = shm::deactivation(++time);
    activities[id].word.store(own[id], std::memory_order_relaxed);
    stamp_fence();
  }
  bool wins(SourceId id) {
    shm::FixedClock clock(kNow);
    shm::Decider decider(view, *pages, clock);
    return decider.decide(view.rule(view.find(id, 0))) == shm::Verdict::kWins;
  }
  // An override's sample is of no interest here; that of `id` waits in the queue.
  void publish(SourceId id) {
    arrive(id);
    accepted[id] = wins(id);
    if (accepted[id]) entry.store(1, std::memory_order_release);
  }
  bool take(SourceId id) { return entry.load(std::memory_order_acquire) != 0 && wins(id); }

  test::TableWords words;
  shm::TableView view;
  std::unique_ptr<shm::ActivityPages> pages = std::make_unique<shm::ActivityPages>();
  shm::Activity activities[kSources];
  shm::ActivityWord own[kSources];
  bool accepted[kSources];
  shm::Nanoseconds time = 1;
  shm::Atomic<std::uint32_t> returned{0};  // what the publisher tells the world once it is back
  shm::Atomic<std::uint32_t> entry{0};
};

test::TableBuilder forever() {
  test::TableBuilder builder;
  for (SourceId id = 0; id < kSources; ++id) builder.timeout(id, shm::kForever);
  return builder;
}

TEST(DecisionInterleavings, TwoThatOverrideEachOtherAreNotBothAccepted) {
  World world(forever().conjunction(kA, 0, {}, {kB}).conjunction(kB, 0, {}, {kA}));
  bool each_won[2] = {false, false};
  const Explorer::Scenario scenario = [&](Execution& execution) {
    world.reset();
    execution.thread([&] { world.publish(kA); });
    execution.thread([&] { world.publish(kB); });
    execution.finally([&] {
      require(!world.accepted[kA] || !world.accepted[kB], "both were accepted");
      each_won[0] = each_won[0] || world.accepted[kA];
      each_won[1] = each_won[1] || world.accepted[kB];
    });
  };
  expect_holds("mutual override", {6, 4}, scenario);
  EXPECT_TRUE(each_won[0] && each_won[1]);
  expect_fails_without("fence (a)", {6, 4}, {Weakness::kFullFence, "stamp_fence"}, scenario);
}

TEST(DecisionInterleavings, AfterAnOverrideHasReturnedNothingOverriddenIsTaken) {
  World world(forever().conjunction(kA, 0, {}, {kB}).connect({kB, 0, shm::table::kAlways, {}, {}}));
  const Explorer::Scenario scenario = [&](Execution& execution) {
    world.reset();
    execution.thread([&] { world.publish(kA); });
    execution.thread([&] {
      world.arrive(kB);
      world.returned.store(1, std::memory_order_relaxed);
    });
    execution.thread([&] {
      for (int i = 0; i < 2; ++i) {
        const bool overridden = world.returned.load(std::memory_order_acquire) != 0;
        require(!world.take(kA) || !overridden, "an overridden sample was taken");
      }
    });
  };
  expect_holds("takeover", {5, 3}, scenario);
  expect_fails_without("fence (a)", {4, 2}, {Weakness::kFullFence, "stamp_fence"}, scenario);
}

// A and not B and not C. B is active; C arrives, then B is deactivated: never are both inactive.
TEST(DecisionInterleavings, MomentsAreNotMixedWhereActivityMovesFromOneToAnother) {
  World world(forever().conjunction(kA, 0, {}, {kC, kB}));
  const Explorer::Scenario scenario = [&](Execution& execution) {
    world.reset();
    world.arrive(kB);
    execution.thread([&] {
      world.arrive(kC);
      world.deactivate(kB);
    });
    execution.thread([&] { require(!world.wins(kA), "two moments were mixed"); });
  };
  expect_holds("one picture", {8, 8}, scenario);
  expect_fails_without("activity-picture", {8, 8}, {Weakness::kAcquire, "SeenActivity"}, scenario);
}

// B and C, of which one is active at a time; each comes back after a break.
TEST(DecisionInterleavings, AnActivityThatWasBrokenOffDoesNotCountAsRenewed) {
  World world(forever().conjunction(kA, 0, {kB, kC}, {}));
  const Explorer::Scenario scenario = [&](Execution& execution) {
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
  };
  expect_holds("breaks", {9, 0}, scenario);
  expect_holds("breaks, with old values", {4, 3}, scenario);
}

}  // namespace
}  // namespace arbiter::explore
