// publish() and take(): slots, order, accounts (shm/channel.hpp, shm/slot_pool.hpp, client/).
#include "tests/explore/components.hpp"

namespace arbiter::explore::take_cases {
namespace {

test::TableBuilder everything() {
  return forever()
      .connect({kA, kPort, shm::table::kAlways, {}, {}})
      .connect({kB, kPort, shm::table::kAlways, {}, {}});
}

// A full queue, of which samples have been overtaken already, and no slot to spare.
Register publish_and_take(const char* name, Limits limits, std::uint32_t samples, int publishes,
                          int takes, bool are_large = false) {
  return {name, limits, [=](const Explore& explore) {
            explore_anew<Scene>(
                explore,
                [=](Scene& scene, Execution& execution) {
                  if (are_large) scene.a().publish_as_large();
                  for (std::uint32_t i = 0; i <= samples; ++i) scene.a().publish();
                  scene.input->take();
                  scene.a().publish();
                  execution.thread([&scene, publishes] {
                    for (int i = 0; i < publishes; ++i) scene.a().publish();
                  });
                  execution.thread([&scene, takes] {
                    for (int i = 0; i < takes; ++i) scene.input->take();
                  });
                  execution.finally([&scene] {
                    scene.drain();
                    require(scene.input->last[kA] == scene.a().published,
                            "the newest sample is not there");
                  });
                },
                everything(), depth(samples), std::initializer_list<SourceId>{kA});
          }};
}
const Register kDepth1 =
    publish_and_take("NoSampleIsWrittenWhileItIsReadWithDepth1", {4, 2}, 1, 2, 2);
const Register kDepth2 =
    publish_and_take("NoSampleIsWrittenWhileItIsReadWithDepth2", {3, 2}, 2, 3, 2);
const Register kLarge1 =
    publish_and_take("NoLargeSampleIsWrittenWhileItIsReadWithDepth1", {4, 2}, 1, 2, 2, true);
const Register kLarge2 =
    publish_and_take("NoLargeSampleIsWrittenWhileItIsReadWithDepth2", {3, 2}, 2, 3, 2, true);
const Register kSlow =
    publish_and_take("ASlowReceiverIsOvertakenAndLosesTheOldest", {3, 2}, 2, 4, 1);

// Two publishers, one of which overrides the other, and a receiver.
Register two_publishers(const char* name, Limits limits, std::uint32_t samples) {
  return {name, limits, [=](const Explore& explore) {
            explore_anew<Scene>(
                explore,
                [](Scene& scene, Execution& execution) {
                  scene.a().publish();
                  execution.thread([&scene] { scene.a().publish(); });
                  execution.thread([&scene] {
                    scene.b().publish();
                    scene.b().deactivate();
                  });
                  execution.thread([&scene] {
                    scene.input->take();
                    scene.input->take();
                  });
                  execution.finally([&scene] { scene.drain(); });
                },
                forever()
                    .conjunction(kA, kPort, {}, {kB})
                    .connect({kB, kPort, shm::table::kAlways, {}, {}}),
                depth(samples), std::initializer_list<SourceId>{kA, kB});
          }};
}
const Register kTwo1 = two_publishers("TwoPublishersAndAReceiverBalanceWithDepth1", {2, 1}, 1);
const Register kTwo2 = two_publishers("TwoPublishersAndAReceiverBalanceWithDepth2", {2, 1}, 2);

// Samples that do not overlap come in the order of their arrival, though their slots are used again
// while the receiver looks at their stamps.
void keep_order(const Explore& explore) {
  explore_anew<Scene>(
      explore,
      [](Scene& scene, Execution& execution) {
        for (int i = 0; i < 5; ++i)
          scene.a().publish();  // one slot is free, those in the queue follow
        scene.b().publish();
        execution.thread([&scene] {
          scene.a().publish();
          scene.a().publish();
        });
        execution.thread([&scene] {
          shm::Nanoseconds last = 0;
          for (int i = 0; i < 3; ++i) {
            if (!scene.input->take()) continue;
            require(scene.input->last_stamp > last, "a later sample came first");
            last = scene.input->last_stamp;
          }
        });
        execution.finally([&scene] { scene.drain(); });
      },
      everything(), depth(2), std::initializer_list<SourceId>{kA, kB});
}
const Register kOrder("SamplesOfSeveralSourcesComeInTheOrderOfTheirArrival", {3, 2}, keep_order);

// A port that refuses what does not fit loses nothing that it has accepted.
void refuse(const Explore& explore) {
  InputPortOptions options = depth(1);
  options.when_full = WhenFull::refuse_new;
  explore_anew<Scene>(
      explore,
      [](Scene& scene, Execution& execution) {
        scene.a().publish();
        execution.thread([&scene] {
          for (int i = 0; i < 3; ++i) scene.a().publish();
        });
        execution.thread([&scene] {
          scene.input->take();
          scene.input->take();
        });
        execution.finally([&scene] {
          scene.drain();
          require(scene.a().delivered == scene.input->taken[kA], "an accepted sample was lost");
          require(scene.a().delivered + scene.a().refused == scene.a().published,
                  "a refused sample is not accounted for");
        });
      },
      everything(), options, std::initializer_list<SourceId>{kA});
}
const Register kRefuse("APortThatRefusesLosesNothingThatItHasAccepted", {4, 2}, refuse);

}  // namespace
}  // namespace arbiter::explore::take_cases
