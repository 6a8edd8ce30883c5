// A process that stops for ever, before any of its operations: the others go on, and lose nothing
// beyond what it had.
#include "tests/explore/components.hpp"
#include "tests/explore/kernel.hpp"

namespace arbiter::explore::death_cases {
namespace {

test::TableBuilder b_overrides_a() {
  return forever()
      .conjunction(kA, kPort, {}, {kB})
      .connect({kB, kPort, shm::table::kAlways, {}, {}});
}
test::TableBuilder everything() {
  return forever()
      .connect({kA, kPort, shm::table::kAlways, {}, {}})
      .connect({kB, kPort, shm::table::kAlways, {}, {}});
}

// The receiver that comes after one that died.
struct DeadReceiver : Scene {
  DeadReceiver() : Scene(everything(), depth(1), {kA}), next(instance.make_input(kPort, depth(1))) {
    for (int i = 0; i < 3; ++i) a().publish();
  }
  std::unique_ptr<Input> next;
  detail::HeldSample held;  // by the one that may die: announced, read, not given back
};

void lose_receiver(const Explore& explore) {
  explore_anew<DeadReceiver>(explore, [](DeadReceiver& scene, Execution& execution) {
    execution.mortal_thread([&scene] {
      for (int i = 0; i < 2; ++i) {
        const detail::HeldSample sample = scene.input->hold();
        if (sample.data == nullptr) continue;
        scene.held = sample;
        scene.input->read_again(sample);
        scene.held = {};
        scene.input->core->give_back(sample.hold);
      }
    });
    execution.thread([&scene] {
      for (int i = 0; i < 4; ++i) scene.a().publish();
    });
    execution.finally([&scene] {
      // What it held is as it was. Its slots come back with the news of its death.
      if (scene.held.data != nullptr) scene.input->read_again(scene.held);
      scene.a().core->remove_peer(scene.input->core->instance());
      scene.instance.connect(scene.a(), *scene.next);
      scene.a().publish();
      const detail::HeldSample sample = scene.next->hold();
      require(sample.data != nullptr, "the next receiver gets nothing");
      for (int i = 0; i < 4; ++i) scene.a().publish();
      scene.next->read_again(sample);
    });
  });
}
const Register kReceiver("AReceiverThatDiesHoldsUpNobodyAndItsSlotsComeBack", {2, 2, 1},
                         lose_receiver);

void lose_waiting_receiver(const Explore& explore) {
  explore_anew<Scene>(
      explore,
      [](Scene& scene, Execution& execution) {
        execution.mortal_thread([&scene] { scene.input->wait(); });
        execution.thread([&scene] {
          for (int i = 0; i < 2; ++i) scene.a().publish();
        });
      },
      everything(), depth(1), std::initializer_list<SourceId>{kA});
}
const Register kWaiter("AReceiverThatDiesWhileItWaitsHoldsUpNobody", {2, 1, 1},
                       lose_waiting_receiver);

// The other publisher gets through; what the dead one has delivered can be taken.
void lose_publisher(const Explore& explore) {
  explore_anew<Scene>(
      explore,
      [](Scene& scene, Execution& execution) {
        scene.a().publish();
        execution.mortal_thread([&scene] {
          scene.a().publish();
          scene.a().publish();
        });
        execution.thread([&scene] { scene.b().publish(); });
        execution.thread([&scene] { scene.input->take(); });
        execution.finally([&scene] {
          scene.input->core->lose_peer(scene.a().core->instance());
          while (scene.input->take()) {
          }
          require(scene.b().delivered == 1, "a dead publisher holds up another");
          require(scene.input->taken[kB] == 1, "a dead publisher keeps another's sample back");
          require(scene.input->last[kA] >= scene.a().delivered,
                  "what the dead one delivered is lost");
        });
      },
      everything(), depth(2), std::initializer_list<SourceId>{kA, kB});
}
const Register kPublisher("APublisherThatDiesHoldsUpNobodyAndWhatItDeliveredIsTaken", {2, 2, 1},
                          lose_publisher);

// An override that has returned holds though its publisher is dead, and through its succession.
struct Succession : Scene {
  explicit Succession(const test::TableBuilder& model)
      : Scene(model, depth(1), {kA, kC}), successor(instance.make_output()) {}
  std::unique_ptr<Output> successor;
};

void succeed(const Explore& explore) {
  explore_anew<Succession>(
      explore,
      [](Succession& scene, Execution& execution) {
        scene.a().publish();
        execution.mortal_thread([&scene] {
          scene.b().signal();
          scene.returned.store(1, std::memory_order_relaxed);
          scene.b().signal();
        });
        execution.thread([&scene] {
          wait_for_end_of(0);
          scene.instance.bind(*scene.successor, kB);
          if (scene.returned.load(std::memory_order_relaxed) != 0) scene.successor->signal();
        });
        execution.thread([&scene] {
          for (int i = 0; i < 2; ++i) {
            const bool overridden = scene.returned.load(std::memory_order_acquire) != 0;
            require(!scene.input->take() || !overridden, "an override died with its publisher");
          }
        });
      },
      b_overrides_a());
}
const Register kSuccession("AnOverrideHoldsThroughTheDeathAndSuccessionOfItsPublisher", {4, 2, 1},
                           succeed);

// A and B are never active together, though their publishers die amid the change from one to the
// other, and others go on from where they were: each comes back after a break, which must count.
struct BothSucceeded : Succession {
  explicit BothSucceeded(const test::TableBuilder& model)
      : Succession(model), successor_of_b(instance.make_output()) {}
  [[nodiscard]] bool is_active(SourceId source) const {
    return shm::is_active(instance.activity(source).word.load(std::memory_order_relaxed),
                          virtual_time());
  }
  std::unique_ptr<Output> successor_of_b;
};

void carry_on(const Explore& explore) {
  explore_anew<BothSucceeded>(
      explore,
      [](BothSucceeded& scene, Execution& execution) {
        scene.a().signal();
        execution.mortal_thread([&scene] {
          scene.a().deactivate();
          scene.b().signal();
          scene.b().deactivate();
        });
        execution.thread([&scene] {
          wait_for_end_of(0);
          scene.instance.bind(*scene.successor, kA);
          scene.instance.bind(*scene.successor_of_b, kB);
          if (scene.is_active(kB)) scene.successor_of_b->deactivate();
          scene.successor->signal();
          scene.successor->deactivate();
          scene.successor_of_b->signal();
        });
        execution.thread(
            [&scene] { require(scene.c().signal().discarded == 1, "two moments were mixed"); });
      },
      forever().conjunction(kC, kPort, {kA, kB}, {}));
}
const Register kCarriesOn("ASuccessorCarriesOnWithTheActivityAndNoMomentsAreMixed", {3, 1, 1},
                          carry_on);

// The daemon dies while it writes a table, or before it has put it in force.
void lose_daemon(const Explore& explore) {
  explore_anew<Scene>(
      explore,
      [](Scene& scene, Execution& execution) {
        execution.mortal_thread([&scene] {
          scene.instance.prepare(forever().connect({kB, kPort, shm::table::kAlways, {}, {}}));
          scene.instance.put_in_force();
          scene.returned.store(1, std::memory_order_release);
        });
        execution.thread([&scene] {
          const bool over = scene.returned.load(std::memory_order_acquire) != 0;
          scene.a().publish();
          require(scene.a().delivered == 0 || !over, "accepted against the model in force");
        });
        execution.thread([&scene] { scene.input->take(); });
        execution.finally([&scene] { scene.drain(); });
      },
      everything(), depth(1), std::initializer_list<SourceId>{kA});
}
const Register kDaemon("ADaemonThatDiesAmidAModelLeavesTheOldOneOrTheNewOne", {2, 1, 1},
                       lose_daemon);

}  // namespace
}  // namespace arbiter::explore::death_cases
