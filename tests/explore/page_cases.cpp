// A source passes to another user: its page is replaced under those who read it, while its former
// owner goes on writing to the old one.
#include "tests/explore/components.hpp"

namespace arbiter::explore::page_cases {
namespace {

// A's sample waits; B, which overrides it, passes to another user.
struct Passing : Scene {
  explicit Passing(const test::TableBuilder& model, SourceId source)
      : Scene(model, depth(1), {kA, kC}), successor(instance.make_output()) {
    instance.make_next_page(source);
  }
  void show(SourceId source, const std::shared_ptr<detail::SharedMemory>& memory) const {
    instance.show_next_page(source, *memory);
  }
  std::unique_ptr<Output> successor;
};

test::TableBuilder b_overrides_a() {
  return forever()
      .conjunction(kA, kPort, {}, {kB})
      .connect({kB, kPort, shm::table::kAlways, {}, {}});
}

// The receiver's node maps the new page at any time, or too late: then its port is blind.
void pass_on(const Explore& explore) {
  explore_anew<Passing>(
      explore,
      [](Passing& scene, Execution& execution) {
        scene.a().publish();
        shm::Activity& old_page = scene.instance.activity(kB);
        execution.thread([&scene] {
          scene.instance.change_page(kB);
          scene.instance.bind(*scene.successor, kB);
          scene.successor->signal();
          scene.returned.store(1, std::memory_order_release);
        });
        execution.thread([&old_page] {
          old_page.word.store(shm::deactivation(1), std::memory_order_relaxed);
          old_page.word.store(shm::deactivation(2), std::memory_order_relaxed);
        });
        execution.thread([&scene] { scene.show(kB, scene.input->memory); });
        execution.thread([&scene] {
          const bool overridden = scene.returned.load(std::memory_order_acquire) != 0;
          require(!scene.input->take() || !overridden, "a former owner has ended an override");
        });
      },
      b_overrides_a(), kB);
}
const Register kPassesOn("AnOverrideOnANewPageHoldsAgainstTheFormerOwner", {2, 1}, pass_on);

// B's activity is carried on: there is no moment at which it is not seen.
struct Carrying : Passing {
  Carrying() : Passing(b_overrides_a(), kB) {
    a().publish();
    b().signal();
    show(kB, input->memory);
  }
};
void carry_on(const Explore& explore) {
  explore_anew<Carrying>(explore, [](Carrying& scene, Execution& execution) {
    execution.thread([&scene] { scene.instance.change_page(kB); });
    execution.thread([&scene] {
      require(!scene.input->take(), "activity was lost with the page that it was on");
    });
  });
}
const Register kCarriesOn("AnActivityIsCarriedOnToTheNextPage", {5, 3}, carry_on);

// A and B are never active together, though A passes to another user in between.
void mix(const Explore& explore) {
  explore_anew<Passing>(
      explore,
      [](Passing& scene, Execution& execution) {
        scene.a().signal();
        scene.show(kA, scene.c().memory);
        execution.thread([&scene] {
          scene.a().deactivate();
          scene.b().signal();
          scene.b().deactivate();
          scene.instance.change_page(kA);
          scene.instance.bind(*scene.successor, kA);
          scene.successor->signal();
        });
        execution.thread(
            [&scene] { require(scene.c().signal().discarded == 1, "two moments were mixed"); });
      },
      forever().conjunction(kC, kPort, {kA, kB}, {}), kA);
}
const Register kMixes("NoDecisionMixesMomentsOfTwoPages", {3, 1}, mix);

// A port that is bound amid the change goes over to the new page: what its owner says is heeded.
struct Bound : Carrying {
  Bound() { show(kB, a().memory); }
};
void go_over(const Explore& explore) {
  explore_anew<Bound>(explore, [](Bound& scene, Execution& execution) {
    execution.thread([&scene] {
      scene.instance.change_page(kB);
      scene.instance.bind(*scene.successor, kB);
      scene.successor->deactivate();
      scene.returned.store(1, std::memory_order_release);
    });
    execution.thread([&scene] {
      for (int i = 0; i < 2; ++i) {
        const bool over = scene.returned.load(std::memory_order_acquire) != 0;
        const bool delivered = scene.a().publish().delivered == 1;
        require(delivered || !over, "the new owner's word is not seen");
      }
    });
  });
}
const Register kGoesOver("WhoIsBoundToAPageThatIsReplacedGoesOverToTheNext", {4, 2}, go_over);

}  // namespace
}  // namespace arbiter::explore::page_cases
