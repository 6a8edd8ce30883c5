// Arbitration at both ends: overrides, deactivation, other models, while ports publish and take.
#include "tests/explore/components.hpp"
#include "tests/explore/kernel.hpp"

namespace arbiter::explore::decide_cases {
namespace {

test::TableBuilder b_overrides_a() {
  return forever()
      .conjunction(kA, kPort, {}, {kB})
      .connect({kB, kPort, shm::table::kAlways, {}, {}});
}

void override_each_other(const Explore& explore) {
  explore_anew<Scene>(
      explore,
      [](Scene& scene, Execution& execution) {
        execution.thread([&scene] { scene.a().publish(); });
        execution.thread([&scene] { scene.b().publish(); });
        execution.finally([&scene] {
          require(scene.a().delivered == 0 || scene.b().delivered == 0, "both were accepted");
        });
      },
      forever().conjunction(kA, kPort, {}, {kB}).conjunction(kB, kPort, {}, {kA}), depth(1),
      std::initializer_list<SourceId>{kA, kB});
}
const Register kMutual("TwoThatOverrideEachOtherAreNotBothAccepted", {5, 3}, override_each_other);

// What has been waiting, and what is on its way in.
void take_over(const Explore& explore) {
  explore_anew<Scene>(
      explore,
      [](Scene& scene, Execution& execution) {
        scene.a().publish();
        execution.thread([&scene] { scene.a().publish(); });
        execution.thread([&scene] {
          scene.b().signal();
          scene.returned.store(1, std::memory_order_relaxed);
        });
        execution.thread([&scene] {
          for (int i = 0; i < 2; ++i) {
            const bool overridden = scene.returned.load(std::memory_order_acquire) != 0;
            require(!scene.input->take() || !overridden, "an overridden sample was taken");
          }
        });
        execution.finally([&scene] { scene.drain(); });
      },
      b_overrides_a(), depth(2), std::initializer_list<SourceId>{kA, kB});
}
const Register kTakeover("AfterAnOverrideHasReturnedNothingOverriddenIsTaken", {3, 2}, take_over);

// A sample that was accepted after an override's end is not dropped by a decision from before it.
void deactivate(const Explore& explore) {
  explore_anew<Scene>(
      explore,
      [](Scene& scene, Execution& execution) {
        scene.a().publish();
        scene.b().signal();
        execution.thread([&scene] {
          scene.b().deactivate();
          scene.a().publish();
        });
        execution.thread([&scene] {
          scene.input->take();
          scene.input->take();
        });
        execution.finally([&scene] {
          require(scene.a().delivered == 2, "an override was seen after its end");
          scene.drain();
          require(scene.input->last[kA] == 2, "what was accepted after the override was dropped");
        });
      },
      b_overrides_a(), depth(2), std::initializer_list<SourceId>{kA, kB});
}
const Register kDeactivate("WhatIsAcceptedAfterADeactivationIsNotDroppedForWhatWasBefore", {4, 3},
                           deactivate);

// The same where another ends it: the publisher has seen that, so the receiver must.
void deactivate_elsewhere(const Explore& explore) {
  explore_anew<Scene>(
      explore,
      [](Scene& scene, Execution& execution) {
        scene.a().publish();
        scene.b().signal();
        execution.thread([&scene] { scene.b().deactivate(); });
        execution.thread([&scene] { scene.a().publish(); });
        execution.thread([&scene] { scene.input->take(); });
        execution.finally([&scene] {
          scene.drain();
          require(scene.a().delivered == 1 || scene.input->last[kA] == 2,
                  "what was accepted after the override was dropped");
        });
      },
      b_overrides_a(), depth(2), std::initializer_list<SourceId>{kA, kB});
}
const Register kElsewhere("WhatOneDeactivationLetsThroughNoEarlierDecisionDrops", {4, 3},
                          deactivate_elsewhere);

// A model that takes A's connection away; then one that gives it to B.
void swap_tables(const Explore& explore) {
  explore_anew<Scene>(
      explore,
      [](Scene& scene, Execution& execution) {
        scene.a().publish();
        execution.thread([&scene] {
          {
            const Uninterrupted at_once;
            scene.instance.prepare(forever().connect({kB, kPort, shm::table::kAlways, {}, {}}));
          }
          scene.instance.put_in_force();
          scene.returned.store(1, std::memory_order_release);
        });
        execution.thread([&scene] {
          const bool over = scene.returned.load(std::memory_order_acquire) != 0;
          require(scene.a().publish().delivered == 0 || !over, "accepted against the model");
        });
        execution.thread([&scene] {
          for (int i = 0; i < 2; ++i) {
            const bool over = scene.returned.load(std::memory_order_acquire) != 0;
            require(!scene.input->take() || !over, "taken against the model in force");
          }
        });
        execution.finally([&scene] { scene.drain(); });
      },
      forever().connect({kA, kPort, shm::table::kAlways, {}, {}}), depth(2),
      std::initializer_list<SourceId>{kA, kB});
}
const Register kSwap("OnceAModelIsInForceNothingIsTakenAgainstIt", {3, 2}, swap_tables);

// So many models are loaded during one call that its table is overwritten: by one whose words, read
// with the old table's, would let A win, which it does under none of them.
Register overwrite_table(const char* name, std::function<void(Scene&)> call) {
  return {name, {2, 0}, [=](const Explore& explore) {
            explore_anew<Scene>(
                explore,
                [=](Scene& scene, Execution& execution) {
                  scene.a().publish();
                  scene.b().signal();
                  execution.thread([&scene] {
                    for (shm::Word i = 1; i < shm::kTableSlots; ++i) {
                      scene.instance.prepare(forever().conjunction(kA, kPort, {}, {kB}));
                      scene.instance.put_in_force();
                    }
                    scene.instance.prepare(forever().conjunction(kA, kPort, {}, {kC, kB}));
                  });
                  execution.thread([&scene, call] { call(scene); });
                },
                forever().conjunction(kA, kPort, {}, {kB}), depth(2),
                std::initializer_list<SourceId>{kA});
          }};
}
const Register kTakeTorn =
    overwrite_table("ATakeIsNotDecidedByATableThatIsOverwritten",
                    [](Scene& scene) { require(!scene.input->take(), "two tables were mixed"); });
const Register kPublishTorn = overwrite_table(
    "APublishIsNotDecidedByATableThatIsOverwritten",
    [](Scene& scene) { require(scene.a().publish().delivered == 0, "two tables were mixed"); });

// A model that gives A's connection to B, in force before B publishes: a take that began before it
// must not drop by the old model what came after the new one.
void swap_before_a_sample(const Explore& explore) {
  explore_anew<Scene>(
      explore,
      [](Scene& scene, Execution& execution) {
        scene.a().publish();
        scene.instance.prepare(forever().connect({kB, kPort, shm::table::kAlways, {}, {}}));
        execution.thread([&scene] {
          scene.instance.put_in_force();
          scene.b().publish();
        });
        execution.thread([&scene] {
          for (int i = 0; i < 2; ++i) scene.input->take();
        });
        execution.finally([&scene] {
          scene.drain();
          require(scene.input->taken[kB] == scene.b().delivered,
                  "what the model in force accepted was dropped by the one before");
        });
      },
      forever().connect({kA, kPort, shm::table::kAlways, {}, {}}), depth(2),
      std::initializer_list<SourceId>{kA, kB});
}
const Register kSwapBefore("WhatAModelInForceAcceptsIsNotDroppedByTheOneBefore", {4, 2},
                           swap_before_a_sample);

// B loses to an active C by the old model only, and C becomes active after the new one is in force:
// B wins at every moment.
Register swap_before_an_override(const char* name, std::function<void(Scene&)> before,
                                 std::function<void(Scene&)> call) {
  return {
      name, {4, 2}, [=](const Explore& explore) {
        explore_anew<Scene>(
            explore,
            [=](Scene& scene, Execution& execution) {
              before(scene);
              scene.instance.prepare(forever().connect({kB, kPort, shm::table::kAlways, {}, {}}));
              execution.thread([&scene] {
                scene.instance.put_in_force();
                scene.c().signal();
              });
              execution.thread([&scene, call] { call(scene); });
              execution.finally([&scene] {
                scene.drain();
                require(scene.input->taken[kB] == 1, "one model decided on another's activities");
              });
            },
            forever().conjunction(kB, kPort, {}, {kC}), depth(1),
            std::initializer_list<SourceId>{kB});
      }};
}
const Register kSwapOverride = swap_before_an_override(
    "NoTakeDecidesByOneModelOnActivitiesOfTheNext", [](Scene& scene) { scene.b().publish(); },
    [](Scene& scene) { scene.input->take(); });
const Register kPublishOverride = swap_before_an_override(
    "NoPublishDecidesByOneModelOnActivitiesOfTheNext", [](Scene&) {},
    [](Scene& scene) { scene.b().publish(); });

// B loses to C by the old model, always by the new one, and C ends after that is in force: B wins
// at no moment.
void swap_before_a_deactivation(const Explore& explore) {
  explore_anew<Scene>(
      explore,
      [](Scene& scene, Execution& execution) {
        scene.c().signal();
        scene.instance.prepare(forever().connect({kA, kPort, shm::table::kAlways, {}, {}}));
        execution.thread([&scene] {
          scene.instance.put_in_force();
          scene.c().deactivate();
        });
        execution.thread([&scene] {
          require(scene.b().publish().delivered == 0, "one model decided on another's activities");
        });
      },
      forever().conjunction(kB, kPort, {}, {kC}), depth(1), std::initializer_list<SourceId>{kB});
}
const Register kSwapDeactivation("NoModelDecidesOnADeactivationUnderTheNext", {4, 2},
                                 swap_before_a_deactivation);

// C ends, and B arrives after that, with the T of the model before, while A publishes under the
// next, by which B's T is longer: never are B and C active together.
void swap_for_a_longer_timeout(const Explore& explore) {
  const auto model = [](shm::Nanoseconds timeout) {
    return forever().timeout(kB, timeout).timeout(kC, 1'000).conjunction(kA, kPort, {kB, kC}, {});
  };
  explore_anew<Scene>(
      explore,
      [model](Scene& scene, Execution& execution) {
        scene.c().signal();
        scene.instance.prepare(model(100'000'000));
        const shm::Nanoseconds end = virtual_time() + 1'000;
        execution.thread([&scene] { scene.instance.put_in_force(); });
        execution.thread([&scene, end] {
          set_virtual_time(end);
          scene.b().signal();
        });
        execution.thread(
            [&scene] { require(scene.a().publish().delivered == 0, "two moments were mixed"); });
      },
      model(100'000), depth(1), std::initializer_list<SourceId>{kA});
}
const Register kSwapTimeout("NoDecisionTakesALongerTimeoutForThatOfAnArrivalBefore", {4, 1},
                            swap_for_a_longer_timeout);

}  // namespace
}  // namespace arbiter::explore::decide_cases
