// Arrivals that come too late, and arrivals whose time is given (OutputCore::begin_replay()).
#include "tests/explore/components.hpp"
#include "tests/explore/kernel.hpp"

namespace arbiter::explore::time_cases {
namespace {

using detail::Waited;

// As OutputPort::signal_at().
void signal_at(Output& output, shm::Nanoseconds at) {
  output.core->begin_replay(at, shm::monotonic_now());
  output.core->signal(at);
}

test::TableBuilder b_overrides_a() {
  return forever()
      .conjunction(kA, kPort, {}, {kB})
      .connect({kB, kPort, shm::table::kAlways, {}, {}});
}

void late(const Explore& explore) {
  explore_anew<Scene>(
      explore,
      [](Scene& scene, Execution& execution) {
        // With a deadline, when it is `left` to it.
        const auto publish_by = [&scene](shm::Nanoseconds left) {
          const std::uint64_t sample = 1;
          const shm::Nanoseconds now = shm::monotonic_now();
          return scene.b().core->publish_copy_by(now + left, &sample, sizeof sample, now);
        };
        execution.thread([&scene, publish_by] {
          require(publish_by(-1).late, "it was in time");
          require(scene.b().core->signal_by(0, shm::monotonic_now()).late, "it was in time");
        });
        execution.thread([&scene] {
          require(scene.a().publish().delivered == 1, "what came too late overrides");
          require(scene.input->take(), "what came too late overrides");
        });
        execution.finally([&scene, publish_by] {
          const auto& activity = scene.instance.activity(kB);
          require(activity.word.load(std::memory_order_relaxed) == shm::kNeverActive,
                  "what came too late is activity");
          const shm::OutputCounters& counters = scene.b().counters();
          require(counters.late.load(std::memory_order_relaxed) == 2 &&
                      counters.published.load(std::memory_order_relaxed) == 0 &&
                      counters.signals.load(std::memory_order_relaxed) == 0,
                  "it is not counted, or as something else");
          require(publish_by(0).delivered == 1, "the deadline itself is late");
          require(scene.input->take() && scene.input->last[kB] == 1, "a sequence number was used");
        });
      },
      b_overrides_a(), depth(1), std::initializer_list<SourceId>{kA, kB});
}
const Register kLate("WhatComesTooLateIsSeenByNobody", {4, 2}, late);

// Once the call has returned, as if it had been made at its time.
void overridden(const Explore& explore) {
  explore_anew<Scene>(
      explore,
      [](Scene& scene, Execution& execution) {
        scene.a().publish();
        execution.thread([&scene] {
          signal_at(scene.b(), shm::monotonic_now() - 500);
          scene.returned.store(1, std::memory_order_relaxed);
        });
        execution.thread([&scene] {
          const bool overridden = scene.returned.load(std::memory_order_acquire) != 0;
          require(!scene.input->take() || !overridden,
                  "a sample of an overridden source was taken");
        });
        execution.thread([&scene] { scene.a().publish(); });
      },
      b_overrides_a(), depth(2), std::initializer_list<SourceId>{kA, kB});
}
const Register kOverridden("AnArrivalAtAGivenTimeOverridesOnceItHasReturned", {3, 2}, overridden);

// When C arrives at its given time B is active, but it has ended since, and who waits has seen it
// end. C makes A the commander, and its end makes the port idle: that must be told.
void begins(const Explore& explore) {
  explore_anew<Scene>(
      explore,
      [](Scene& scene, Execution& execution) {
        const shm::Nanoseconds start = shm::monotonic_now();
        scene.a().publish();
        scene.b().signal();
        set_virtual_time(start + 20'000);
        execution.thread([&scene, start] { signal_at(scene.c(), start + 5'000); });
        execution.thread([&scene] {
          require(scene.input->wait() == Waited::kIdle, "it was woken for another reason");
        });
      },
      forever().timeout(kB, 10'000).timeout(kC, 100'000).conjunction(kA, kPort, {kC}, {kB}),
      depth(1), std::initializer_list<SourceId>{kA});
}
const Register kBegins("AReceiverThatWaitsIsWokenForAnArrivalThatIsOlderThanWhatItHasSeenEnd",
                       {4, 2}, begins);

// C was active until it ended for those who wait, but not for an arrival before that.
void begins_again(const Explore& explore) {
  explore_anew<Scene>(
      explore,
      [](Scene& scene, Execution& execution) {
        const shm::Nanoseconds start = shm::monotonic_now();
        scene.a().publish();
        scene.c().signal();
        set_virtual_time(start + 15'000);
        execution.thread([&scene, start] { signal_at(scene.c(), start + 9'000); });
        execution.thread([&scene] {
          require(scene.input->wait() == Waited::kIdle, "it was woken for another reason");
        });
      },
      forever().timeout(kC, 10'000).conjunction(kA, kPort, {kC}, {}), depth(1),
      std::initializer_list<SourceId>{kA});
}
const Register kBeginsAgain("AReceiverThatWaitsIsWokenWhereAnArrivalAtAGivenTimeClosesAGap", {4, 2},
                            begins_again);

}  // namespace
}  // namespace arbiter::explore::time_cases
