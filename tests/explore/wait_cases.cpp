// wait_for(): no wake-up is lost (fences (a), (b) and (d)), whatever it is that wakes.
#include "tests/explore/components.hpp"

namespace arbiter::explore {
namespace {

using detail::Waited;

test::TableBuilder b_overrides_a() {
  return forever()
      .conjunction(kA, kPort, {}, {kB})
      .connect({kB, kPort, shm::table::kAlways, {}, {}});
}

void wait_for(Scene& scene, Waited what) {
  require(scene.input->wait() == what, "it was woken for another reason");
}

void samples(const Explore& explore) {
  explore_anew<Scene>(
      explore,
      [](Scene& scene, Execution& execution) {
        execution.thread([&scene] {
          scene.a().publish();
          scene.a().publish();
        });
        execution.thread([&scene] {
          while (scene.input->last[kA] != 2) wait_for(scene, Waited::kSample);
        });
        execution.finally([&scene] { scene.drain(); });
      },
      b_overrides_a(), depth(1), std::initializer_list<SourceId>{kA});
}
const Register kSamples("AReceiverThatWaitsIsWokenForEachSample", {3, 1}, samples);

// B, which is not connected, only says stop.
void stop(const Explore& explore) {
  explore_anew<Scene>(
      explore,
      [](Scene& scene, Execution& execution) {
        scene.a().publish();
        scene.input->take();
        execution.thread([&scene] { scene.b().signal(); });
        execution.thread([&scene] { wait_for(scene, Waited::kIdle); });
      },
      forever().conjunction(kA, kPort, {}, {kB}), depth(1), std::initializer_list<SourceId>{kA});
}
const Register kStop("AReceiverThatWaitsIsToldOfAnOverrideWithoutASample", {5, 3}, stop);

void end(const Explore& explore) {
  explore_anew<Scene>(
      explore,
      [](Scene& scene, Execution& execution) {
        scene.a().publish();
        scene.input->take();
        execution.thread([&scene] { scene.a().deactivate(); });
        execution.thread([&scene] { wait_for(scene, Waited::kIdle); });
      },
      b_overrides_a(), depth(1), std::initializer_list<SourceId>{kA, kB});
}
const Register kEnd("AReceiverThatWaitsIsToldOfADeactivation", {5, 3}, end);

// It believes something else in each of its waits.
void sample_and_stop(const Explore& explore) {
  explore_anew<Scene>(
      explore,
      [](Scene& scene, Execution& execution) {
        execution.thread([&scene] { scene.a().publish(); });
        execution.thread([&scene] {
          wait_for(scene, Waited::kSample);
          scene.returned.store(1, std::memory_order_relaxed);
          wait_for(scene, Waited::kIdle);
        });
        execution.thread([&scene] {
          wait_until([&scene] { return scene.returned.load(std::memory_order_relaxed) != 0; });
          scene.b().signal();
        });
      },
      forever().conjunction(kA, kPort, {}, {kB}), depth(1), std::initializer_list<SourceId>{kA});
}
const Register kBelief("AReceiverThatWaitsAgainIsTakenAtItsNewBelief", {2, 1}, sample_and_stop);

// Activity ends by itself; nobody rings for it.
void run_out(const Explore& explore) {
  test::TableBuilder model;
  for (SourceId id = 0; id < kSources; ++id) model.timeout(id, 1000);
  explore_anew<Scene>(
      explore,
      [](Scene& scene, Execution& execution) {
        scene.a().publish();
        scene.input->take();
        execution.thread([&scene] { scene.a().signal(); });
        execution.thread([&scene] { wait_for(scene, Waited::kIdle); });
      },
      model.conjunction(kA, kPort, {}, {kB}), depth(1), std::initializer_list<SourceId>{kA});
}
const Register kRunOut("AReceiverThatWaitsIsToldWhenActivityRunsOut", {4, 2}, run_out);

// Its publisher has delivered before it learns of it.
void news(const Explore& explore) {
  explore_anew<Scene>(
      explore,
      [](Scene& scene, Execution& execution) {
        execution.thread([&scene] {
          Instance::tell_output(scene.a(), *scene.input, 1);
          scene.a().publish();
          Instance::tell_input(*scene.input, scene.a(), 1);
        });
        execution.thread([&scene] { wait_for(scene, Waited::kSample); });
        execution.finally([&scene] { scene.drain(); });
      },
      b_overrides_a(), depth(1), std::initializer_list<SourceId>{});
}
const Register kNews("AReceiverThatWaitsIsWokenForAPublisherThatItDidNotKnow", {3, 6}, news);

// B overrides A, which is active all the time: one of the two commands at every moment.
void always_commanded(const Explore& explore) {
  explore_anew<Scene>(
      explore,
      [](Scene& scene, Execution& execution) {
        scene.a().publish();
        scene.b().signal();
        execution.thread([&scene] {
          scene.b().deactivate();
          scene.b().signal();
        });
        execution.thread([&scene] {
          require(!scene.input->core->is_idle(), "it is idle, though somebody commands always");
        });
      },
      b_overrides_a(), depth(1), std::initializer_list<SourceId>{kA, kB});
}
const Register kAlways("APortThatIsCommandedAllTheTimeIsNeverIdle", {4, 3}, always_commanded);

// The descriptor for a loop of one's own.
struct Polling : Scene {
  Polling() : Scene(b_overrides_a(), depth(1), {kA}) {
    input->core->wait_descriptor();
    input->take();
  }
};

void poll(const Explore& explore) {
  explore_anew<Polling>(explore, [](Polling& scene, Execution& execution) {
    execution.thread([&scene] { scene.a().publish(); });
    execution.thread([&scene] {
      while (!scene.input->take()) scene.input->core->bell().wait(shm::kForever);
    });
    execution.finally([&scene] { scene.drain(); });
  });
}
const Register kPoll("ADescriptorBecomesReadableForEachSample", {4, 2}, poll);

}  // namespace
}  // namespace arbiter::explore
