// Ports that come and go while others work: views, queues that begin and end, lanes, pages.
#include "tests/explore/components.hpp"

namespace arbiter::explore::joining_cases {
namespace {

test::TableBuilder everything() {
  return forever()
      .connect({kA, kPort, shm::table::kAlways, {}, {}})
      .connect({kB, kPort, shm::table::kAlways, {}, {}})
      .connect({kA, kOther, shm::table::kAlways, {}, {}});
}

// The publisher delivers to another port, and its slots go round, when a receiver joins.
struct Joining : Scene {
  Joining() : Scene(everything(), depth(1), {}), other(instance.make_input(kOther, depth(1))) {
    instance.connect(a(), *other);
    for (int i = 0; i < 3; ++i) a().publish();
    other->take();
    delivered_before = a().delivered;
  }
  std::unique_ptr<Input> other;
  std::uint64_t delivered_before = 0;
};

void join(const Explore& explore) {
  explore_anew<Joining>(explore, [](Joining& scene, Execution& execution) {
    execution.mortal_thread([&scene] {
      Instance::tell_output(scene.a(), *scene.input, 9);
      Instance::tell_input(*scene.input, scene.a(), 9);
    });
    execution.thread([&scene] {
      for (int i = 0; i < 3; ++i) scene.a().publish();
    });
    execution.thread([&scene] {
      for (int i = 0; i < 2; ++i) scene.input->take();
    });
    execution.finally([&scene] {
      if (Explorer::running()->is_halted(0)) return;
      scene.a().publish();
      const std::uint64_t twice = scene.a().delivered - scene.delivered_before;
      const std::uint64_t to_other = scene.a().published - 3;
      while (scene.input->take()) {
      }
      require(scene.input->last[kA] == scene.a().published, "a receiver that joined has no queue");
      const auto overtaken = scene.input->counters().overtaken.load(std::memory_order_relaxed);
      require(scene.input->taken[kA] + overtaken == twice - to_other, "a sample of before counts");
    });
  });
}
const Register kJoin("AReceiverThatJoinsGetsAllFromThereOn", {2, 2, 1}, join);

// A sample waits. While it is being taken a publisher joins and delivers, and only then another's
// next sample takes the place of the one that waited. The take must not return that one before what
// it did not know of when it began.
struct Overtaking : Scene {
  Overtaking() : Scene(everything(), depth(1), {kB}) { b().publish(); }
};

void join_amid_a_take(const Explore& explore) {
  explore_anew<Overtaking>(explore, [](Overtaking& scene, Execution& execution) {
    execution.thread([&scene] {
      scene.instance.connect(scene.a(), *scene.input);
      scene.a().publish();
      scene.b().publish();
    });
    execution.thread([&scene] {
      for (int i = 0; i < 2; ++i) {
        scene.input->take();
        require(scene.input->last[kB] != 2 || scene.input->taken[kA] == 1,
                "a later sample came before that of a publisher that had joined");
      }
    });
    execution.finally([&scene] {
      scene.drain();
      require(scene.input->taken[kA] == 1 && scene.input->last[kB] == 2, "a sample was lost");
    });
  });
}
const Register kOvertaking("ATakeReturnsNothingLaterThanWhatAPublisherThatJoinedHasDelivered",
                           {3, 2}, join_amid_a_take);

// The publisher knows of the receiver before the receiver knows of it.
struct Introduced : Scene {
  explicit Introduced(const InputPortOptions& options) : Scene(everything(), options, {kB}) {
    Instance::tell_output(a(), *input, 9);
  }
};

// Nothing comes behind what was published later; all that is accepted is taken or counted.
void take_up_amid_takes(const Explore& explore, const InputPortOptions& options) {
  const auto scenario = [keep = options.keep](Introduced& scene, Execution& execution) {
    execution.thread([&scene] { Instance::tell_input(*scene.input, scene.a(), 9); });
    execution.thread([&scene] {
      scene.a().publish();
      scene.b().publish();
    });
    execution.thread([&scene] {
      for (int i = 0; i < 2; ++i) {
        const bool is_late = scene.input->last[kB] != 0 && scene.input->taken[kA] == 0;
        scene.input->take();
        require(!is_late || scene.input->taken[kA] == 0,
                "a sample came behind one that was published later");
      }
    });
    execution.finally([&scene, keep] {
      const auto blind = scene.a().counters().blind.load(std::memory_order_relaxed);
      require(scene.a().delivered + blind == 1 && scene.a().discarded == blind,
              "a sample was neither accepted nor counted as discarded");
      require(keep || blind == 0, "an arbitrated port is awaited");
      scene.a().publish();
      require(scene.a().delivered + blind == 2, "a link that was taken up has no queue");
      scene.drain();
    });
  };
  explore_anew<Introduced>(explore, scenario, options);
}
const Register kTakeUp("APublisherThatIsTakenUpLateComesNotBehindWhatIsPublishedLater", {3, 2},
                       [](const Explore& explore) { take_up_amid_takes(explore, depth(1)); });
InputPortOptions keeping() {
  InputPortOptions options = depth(2);
  options.keep = true;
  return options;
}
const Register kTakeUpKeeping("APortThatKeepsAllIsHandedNothingOfAPublisherThatItHasNotTakenUp",
                              {3, 2}, [](const Explore& explore) {
                                take_up_amid_takes(explore, keeping());
                              });

InputPortOptions refusing() {
  InputPortOptions options = depth(1);
  options.when_full = WhenFull::refuse_new;
  return options;
}

// A connection ends by another model, while its sample is being taken; its slot is used again at
// once, for there is no other.
struct Leaving : Scene {
  Leaving() : Scene(everything(), refusing(), {kA}), other(instance.make_input(kOther, depth(1))) {
    instance.connect(a(), *other);
    for (int i = 0; i < 5; ++i) a().publish();
  }
  std::unique_ptr<Input> other;
};

void leave(const Explore& explore, bool are_large) {
  explore_anew<Leaving>(explore, [=](Leaving& scene, Execution& execution) {
    if (are_large) scene.a().publish_as_large();
    execution.thread([&scene] {
      scene.a().core->disconnect_peer(scene.input->core->instance());
      for (int i = 0; i < 3; ++i) scene.a().publish();
    });
    execution.thread([&scene] { scene.input->take(); });
  });
}
const Register kLeave("AConnectionThatEndsTakesItsSampleFromNobodyWhoHoldsIt", {4, 3},
                      [](const Explore& explore) { leave(explore, false); });
const Register kLeaveLarge("AConnectionThatEndsTakesItsLargeSampleFromNobodyWhoHoldsIt", {4, 3},
                           [](const Explore& explore) { leave(explore, true); });

// A receiver's lane is given to another publisher, which must not take the old one's word for its
// own.
struct Lanes : Scene {
  Lanes() : Scene(everything(), refusing(), {kA}) {
    for (int i = 0; i < 3; ++i) {
      a().publish();
      input->take();
    }
    instance.connect(b(), *input);
    b().publish();
    input->core->disconnect_peer(a().core->instance());
  }
};

void reuse_lane(const Explore& explore) {
  explore_anew<Lanes>(explore, [](Lanes& scene, Execution& execution) {
    execution.thread([&scene] {
      scene.b().publish();
      scene.b().publish();
    });
    execution.thread([&scene] { scene.input->take(); });
    execution.finally([&scene] {
      scene.drain();
      require(scene.b().delivered == scene.input->taken[kB], "an accepted sample was lost");
    });
  });
}
const Register kLane("AReceiversWordToOnePublisherIsNotTakenForItsWordToTheNext", {5, 3},
                     reuse_lane);

// The same publisher is connected again, by another channel, of which less has been read.
struct Relinked : Scene {
  Relinked() : Scene(everything(), refusing(), {kA}), other(instance.make_input(kOther, depth(1))) {
    for (int i = 0; i < 3; ++i) {
      a().publish();
      input->take();
    }
    a().core->disconnect_peer(input->core->instance());
    input->core->disconnect_peer(a().core->instance());
    a().publish();
    instance.connect(a(), *other);  // by the channel that is free now
    a().publish();
    instance.connect(a(), *input);
    a().publish();
  }
  std::unique_ptr<Input> other;
};

void relink(const Explore& explore, bool are_large) {
  explore_anew<Relinked>(explore, [=](Relinked& scene, Execution& execution) {
    if (are_large) scene.a().publish_as_large();
    execution.thread([&scene] {
      scene.a().publish();
      scene.a().publish();
    });
    execution.thread([&scene] { scene.input->take(); });
    execution.finally([&scene] {
      while (scene.input->take()) {
      }
      require(scene.input->counters().overtaken.load(std::memory_order_relaxed) == 0,
              "a port that refuses was overtaken");
    });
  });
}
const Register kRelink("AReceiversWordOnOneLinkIsNotTakenForItsWordOnTheNext", {5, 3},
                       [](const Explore& explore) { relink(explore, false); });
const Register kRelinkLarge("AReceiversWordOnOneLinkFreesNoLargeSampleOfTheNext", {4, 3},
                            [](const Explore& explore) { relink(explore, true); });

// Two publishers of one source come and go, each leaving a sample that its successor's pushes out.
// They are let go of by the service thread, while the component takes; before or after it has known
// of them. Each of their samples is taken, or counted, once.
struct Restarts : Scene {
  Restarts() : Scene(everything(), depth(1), {kA}), second(successor(1)), third(successor(2)) {
    a().publish();
  }
  // Its sequence goes on where its predecessor's ends.
  std::unique_ptr<Output> successor(int published_before) {
    auto output = instance.make_output();
    instance.bind(*output, kA);
    Instance::tell_output(*output, *input, 0);
    for (int i = 0; i < published_before; ++i) output->publish();
    return output;
  }
  void succeed(const Output& before, Output& after) {
    input->core->lose_peer(before.core->instance());
    instance.connect(after, *input);
    after.publish();
  }
  std::unique_ptr<Output> second;
  std::unique_ptr<Output> third;
};

void restart(const Explore& explore) {
  explore_anew<Restarts>(explore, [](Restarts& scene, Execution& execution) {
    execution.thread([&scene] {
      scene.succeed(scene.a(), *scene.second);
      scene.succeed(*scene.second, *scene.third);
      scene.input->core->tidy();
    });
    execution.thread([&scene] {
      for (int i = 0; i < 2; ++i) scene.input->take();
    });
    execution.finally([&scene] {
      while (scene.input->take()) {
      }
      const shm::InputCounters& counters = scene.input->counters();
      require(scene.input->last[kA] == 3, "the last sample was lost");
      require(counters.dropped.load(std::memory_order_relaxed) == 0, "a winner's was dropped");
      require(scene.input->taken[kA] + counters.overtaken.load(std::memory_order_relaxed) == 3,
              "a sample was counted twice, or not at all");
    });
  });
}
const Register kRestarts("APublisherThatIsLetGoOfTakesNoSampleWithItUncounted", {3, 1}, restart);

// client/handover.hpp by itself: a view is taken up whole, and disposed of after its last use.
struct Offered {
  explicit Offered(int which) : number(which) {}
  ~Offered() { content.write(0); }
  int number;
  Plain<int> content;
  Offered* next_retired = nullptr;
};

struct Views {
  detail::Handover<Offered> handover;
};

void hand_over(const Explore& explore) {
  explore_anew<Views>(explore, [](Views& views, Execution& execution) {
    execution.thread([&views] {
      for (int i = 1; i <= 2; ++i) {
        auto view = std::make_unique<Offered>(i);
        view->content.write(i);
        views.handover.offer(std::move(view));
      }
      views.handover.collect();
    });
    execution.thread([&views] {
      std::unique_ptr<Offered> current;
      for (int i = 0; i < 2; ++i) {
        if (!views.handover.has_offer()) continue;
        auto view = views.handover.accept();
        require(view != nullptr, "what was offered was withdrawn");
        require(view->content.read() == view->number, "a view is not whole");
        views.handover.retire(std::exchange(current, std::move(view)));
      }
      views.handover.retire(std::move(current));
    });
  });
}
const Register kViews("AViewIsTakenUpWholeAndDisposedOfAfterItsLastUse", {6, 4}, hand_over);

// A page is found once it is mapped. The mapping, which is the kernel's, is plain data here.
struct Pages {
  shm::ActivityPages pages;
  shm::Activity activity;
  Plain<bool> is_mapped;
};

void attach(const Explore& explore) {
  explore_anew<Pages>(explore, [](Pages& pages, Execution& execution) {
    execution.thread([&pages] {
      pages.is_mapped.write(true);
      pages.pages.attach(kA, &pages.activity);
    });
    execution.thread([&pages] {
      if (pages.pages.find(kA) == nullptr) return;
      require(pages.is_mapped.read(), "a page was found before it was mapped");
    });
  });
}
const Register kPages("APageIsFoundOnceItIsMapped", {6, 4}, attach);

// What a rule is bound to is looked up again when the pages have changed: then it must be found.
void attach_under_a_bound_rule(const Explore& explore) {
  explore_anew<Pages>(explore, [](Pages& pages, Execution& execution) {
    const std::uint64_t bound = pages.pages.changes();
    execution.thread([&pages] { pages.pages.attach(kA, &pages.activity); });
    execution.thread([&pages, bound] {
      if (pages.pages.changes() == bound) return;
      require(pages.pages.find(kA) != nullptr, "a rule is bound again, and stays blind");
    });
  });
}
const Register kChanges("WhoSeesThatPagesHaveChangedFindsThem", {6, 4}, attach_under_a_bound_rule);

}  // namespace
}  // namespace arbiter::explore::joining_cases
