// wait_for(): no wake-up is lost (fences (a), (b) and (d)), whatever it is that wakes.
#include "tests/explore/components.hpp"
#include "tests/explore/kernel.hpp"

namespace arbiter::explore::wait_cases {
namespace {

using detail::Waited;

constexpr shm::Nanoseconds kTimeout = 100'000;  // longer than any execution

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

// It is ended once it has run out: then nobody is told, for it has ended before.
void end_after_run_out(const Explore& explore) {
  explore_anew<Scene>(
      explore,
      [](Scene& scene, Execution& execution) {
        scene.a().publish();
        scene.input->take();
        const auto& activity = scene.instance.activity(kA);
        const shm::Nanoseconds end = activity.word.load(std::memory_order_relaxed);
        execution.thread([&scene, end] {
          set_virtual_time(end);
          scene.a().deactivate();
        });
        execution.thread([&scene] { wait_for(scene, Waited::kIdle); });
      },
      forever().timeout(kA, kTimeout).conjunction(kA, kPort, {}, {kB}), depth(1),
      std::initializer_list<SourceId>{kA});
}
const Register kEndAfterRunOut("AReceiverThatWaitsIsToldOfADeactivationThatComesAfterTheEnd",
                               {3, 1}, end_after_run_out);

// A commands while B or C is active. C takes over from B, which changes no selection, and runs out.
void alternative(const Explore& explore) {
  using namespace shm::table;
  explore_anew<Scene>(
      explore,
      [](Scene& scene, Execution& execution) {
        scene.b().signal();
        scene.a().publish();
        scene.input->take();
        execution.thread([&scene] {
          scene.c().signal();
          scene.b().deactivate();
        });
        execution.thread([&scene] { wait_for(scene, Waited::kIdle); });
      },
      forever()
          .timeout(kC, kTimeout)
          .connect({kA, kPort, kDiagram, {kB, kC}, {0, 1, kTrue, 1, kFalse, kTrue}}),
      depth(1), std::initializer_list<SourceId>{kA});
}
const Register kAlternative("AReceiverThatWaitsIsToldWhenAnAlternativeThatHasBegunRunsOut", {3, 2},
                            alternative);

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
  explicit Polling(const test::TableBuilder& model = b_overrides_a())
      : Scene(model, depth(1), {kA}) {
    input->core->wait_descriptor();
    input->take();
  }
  void believe_a() {
    a().publish();
    input->take();
    input->take();
    a().publish();
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

// It believes A, and the next take that finds nothing arms it again for that. B is not connected.
struct PollingA : Polling {
  PollingA() : Polling(forever().conjunction(kA, kPort, {}, {kB})) { believe_a(); }
};

void poll_again(const Explore& explore) {
  explore_anew<PollingA>(explore, [](PollingA& scene, Execution& execution) {
    execution.thread([&scene] { scene.a().publish(); });
    execution.thread([&scene] {
      while (!scene.input->take()) scene.input->core->bell().wait(shm::kForever);
    });
    execution.finally([&scene] { scene.drain(); });
  });
}
const Register kPollAgain("ADescriptorThatIsArmedAgainBecomesReadableForEachSample", {4, 2},
                          poll_again);

void poll_until_idle(Polling& scene) {
  for (;;) {
    require(!scene.input->take(), "a sample comes from nowhere");
    if (scene.input->core->is_idle()) return;
    scene.input->core->bell().wait(timer_expires_at());
  }
}

template <class Change>
void poll_change(const Explore& explore, const Change& change) {
  explore_anew<PollingA>(explore, [&](PollingA& scene, Execution& execution) {
    execution.thread([&scene, &change] { change(scene); });
    execution.thread([&scene] { poll_until_idle(scene); });
  });
}
const Register kPollOverride("ADescriptorThatIsArmedAgainBecomesReadableAtAnOverride", {4, 2},
                             [](const Explore& explore) {
                               poll_change(explore, [](PollingA& scene) { scene.b().signal(); });
                             });
const Register kPollEnd("ADescriptorThatIsArmedAgainBecomesReadableAtADeactivation", {4, 2},
                        [](const Explore& explore) {
                          poll_change(explore, [](PollingA& scene) { scene.a().deactivate(); });
                        });

// The same where A commands only while B is active, which runs out.
struct PollingWhileB : Polling {
  PollingWhileB() : Polling(forever().timeout(kB, kTimeout).conjunction(kA, kPort, {kB}, {})) {}
  // When B ends.
  shm::Nanoseconds begin() {
    b().signal();
    believe_a();
    return instance.activity(kB).word.load(std::memory_order_relaxed);
  }
  [[nodiscard]] bool is_readable() const {
    return is_rung(input->core->bell()) || shm::monotonic_now() >= timer_expires_at();
  }
  [[nodiscard]] bool believes_a() const {
    const auto& header = input->mapping.as<shm::InputSegment>()->header;
    return header.believed.load(std::memory_order_relaxed) == kA;
  }
};

// It may run out between any two looks of the take that arms the descriptor.
void poll_run_out(const Explore& explore) {
  explore_anew<PollingWhileB>(explore, [](PollingWhileB& scene, Execution& execution) {
    const shm::Nanoseconds end = scene.begin();
    execution.thread([end] { set_virtual_time(end); });
    execution.thread([&scene] { require(!scene.input->take(), "a sample comes from nowhere"); });
    execution.finally([&scene] {
      require(scene.is_readable() || !scene.believes_a(), "it believes what is no longer so");
    });
  });
}
const Register kPollRunOut("ADescriptorThatIsArmedAgainBecomesReadableWhenActivityRunsOut", {4, 2},
                           poll_run_out);

}  // namespace
}  // namespace arbiter::explore::wait_cases
