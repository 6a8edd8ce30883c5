// Taps of the real ports: they see each arrival once, and change nothing for anybody else.
#include "tests/explore/components.hpp"

namespace arbiter::explore::tap_cases {
namespace {

test::TableBuilder a_alone() { return forever().connect({kA, kPort, shm::table::kAlways, {}, {}}); }

TapOptions options(bool may_wait) {
  TapOptions options;
  options.may_wait = may_wait;
  return options;
}

struct Watched : Scene {
  explicit Watched(bool may_wait)
      : Scene(a_alone(), depth(1), {kA}), watcher(instance.make_watcher(options(may_wait))) {}
  std::unique_ptr<Watcher> watcher;
};

// A tap that is there already waits for each event.
struct Waiting : Watched {
  Waiting() : Watched(true) {
    Instance::tell_tap(a(), *watcher);
    a().settle();
    watcher->take();
  }
};

void wait(const Explore& explore) {
  explore_anew<Waiting>(explore, [](Waiting& scene, Execution& execution) {
    execution.thread([&scene] {
      for (int i = 0; i < 2; ++i) scene.a().publish();
    });
    execution.thread([&scene] {
      while (scene.watcher->seen < 2) scene.watcher->wait();
    });
    execution.finally([&scene] {
      scene.drain();
      require(scene.watcher->accepted == 2, "a fate was told wrongly");
    });
  });
}
const Register kWait("ATapThatWaitsIsWokenForEachEvent", {2, 1}, wait);

// A tap waits, and is told of a source that has told it something already.
struct Unknown : Watched {
  Unknown() : Watched(true), other(instance.make_watcher(options(false))) {
    Instance::tell_tap(a(), *other);
    a().settle();
  }
  std::unique_ptr<Watcher> other;  // that is there already
};

void hear_of_a_source(const Explore& explore) {
  explore_anew<Unknown>(explore, [](Unknown& scene, Execution& execution) {
    execution.thread([&scene] {
      const auto entry = Instance::tell_tapped(scene.a(), *scene.watcher);
      scene.a().publish();
      Instance::tell_watcher(scene.a(), *scene.watcher, entry);
    });
    execution.thread([&scene] {
      while (scene.watcher->seen == 0) scene.watcher->wait();
    });
  });
}
const Register kUnknown("ATapThatWaitsIsWokenForASourceThatItDidNotKnow", {3, 2}, hear_of_a_source);

// One joins while its source publishes and a receiver takes; the tap may die anywhere.
struct Joining : Watched {
  Joining() : Watched(false), other(instance.make_watcher(options(false))) {
    Instance::tell_tap(a(), *other);
    a().publish();
  }
  std::unique_ptr<Watcher> other;  // that is there already
};

void join(const Explore& explore) {
  explore_anew<Joining>(explore, [](Joining& scene, Execution& execution) {
    execution.thread([&scene] {
      Instance::tell_tap(scene.a(), *scene.watcher);
      scene.returned.store(1, std::memory_order_relaxed);
    });
    execution.thread([&scene] {
      for (int i = 0; i < 2; ++i) scene.a().publish();
    });
    execution.mortal_thread([&scene] {
      for (int i = 0; i < 2; ++i) scene.watcher->take();
    });
    execution.finally([&scene] {
      scene.a().publish();
      scene.drain();
      while (scene.other->take()) {
      }
      require(scene.other->seen == scene.a().published, "another tap missed an event");
      if (Explorer::running()->is_halted(2)) return;
      while (scene.watcher->take()) {
      }
      require(scene.watcher->last == scene.a().published, "the last event was not told");
      require(scene.watcher->lost == 0, "an event was lost");
    });
  });
}
const Register kJoin("ATapThatJoinsSeesAllFromThereOnAndHoldsUpNobody", {2, 1, 1}, join);

// A sample that is kept for taps gives way to a later one while a tap takes hold of it, and its
// slot is used again by the next publish: there are no others.
struct Overwriting : Watched {
  Overwriting() : Watched(false) {
    Instance::tell_tap(a(), *watcher);
    // 64 samples are kept; the queue, the hold, the tap's hold and the copy have a slot each, and
    // all of these but one have been used once more since the pool has last looked for free ones.
    for (int i = 0; i < 71; ++i) a().publish();
    while (watcher->last < 7) watcher->take();
  }
};

void overwrite(const Explore& explore, bool are_large) {
  explore_anew<Overwriting>(explore, [=](Overwriting& scene, Execution& execution) {
    if (are_large) scene.a().publish_as_large();
    execution.thread([&scene] {
      for (int i = 0; i < 2; ++i) scene.a().publish();
    });
    execution.mortal_thread([&scene] { scene.watcher->take(); });
  });
}
const Register kOverwrite("NoSampleIsWrittenWhileATapOfARealPortReadsIt", {3, 2, 1},
                          [](const Explore& explore) { overwrite(explore, false); });
const Register kOverwriteLarge("NoLargeSampleIsWrittenWhileATapOfARealPortReadsIt", {3, 2, 1},
                               [](const Explore& explore) { overwrite(explore, true); });

// One that holds a sample closes, or dies and is told of, while the port publishes.
struct Leaving : Watched {
  Leaving() : Watched(false) {
    Instance::tell_tap(a(), *watcher);
    a().settle();
    watcher->take();
  }
};

void leave(const Explore& explore) {
  explore_anew<Leaving>(explore, [](Leaving& scene, Execution& execution) {
    execution.thread([&scene] { scene.a().core->remove_tap(scene.watcher->core->instance()); });
    execution.thread([&scene] {
      for (int i = 0; i < 3; ++i) scene.a().publish();
    });
    execution.finally([&scene] {
      for (int i = 0; i < 3; ++i) scene.a().publish();
      scene.drain();
    });
  });
}
const Register kLeave("ATapThatLeavesGivesAllSlotsBack", {3, 2}, leave);

}  // namespace
}  // namespace arbiter::explore::tap_cases
