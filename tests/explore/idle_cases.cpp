// A winner that cannot deliver: its port is idle, is told so once, and is not once it can again.
// What the service thread learns of peers that have gone, come, or are refused comes by views.
#include "tests/explore/components.hpp"

namespace arbiter::explore::idle_cases {
namespace {

using detail::Waited;

test::TableBuilder b_overrides_a() {
  return forever()
      .conjunction(kA, kPort, {}, {kB})
      .connect({kB, kPort, shm::table::kAlways, {}, {}});
}

// A has commanded, and its activity lasts for ever.
struct Commanded : Scene {
  Commanded(const test::TableBuilder& model, const InputPortOptions& options)
      : Scene(model, options, {kA}), successor(instance.make_output()) {
    a().publish();
    input->take();
  }
  [[nodiscard]] bool is_idle() const { return input->core->is_idle(); }
  [[nodiscard]] std::uint64_t idles() const {
    return input->counters().idles.load(std::memory_order_relaxed);
  }
  std::unique_ptr<Output> successor;
};

void wait_for(Commanded& scene, Waited what) {
  require(scene.input->wait() == what, "it was woken for another reason");
}

void gone(const Explore& explore) {
  explore_anew<Commanded>(
      explore,
      [](Commanded& scene, Execution& execution) {
        execution.thread([&scene] { scene.input->core->lose_peer(scene.a().core->instance()); });
        execution.thread([&scene] {
          wait_for(scene, Waited::kIdle);
          require(scene.is_idle(), "it is not idle, though it was told so");
          require(!scene.input->core->winner(), "who is gone commands");
        });
        execution.finally([&scene] { require(scene.idles() == 1, "it was told twice"); });
      },
      b_overrides_a(), depth(1));
}
const Register kGone("AReceiverThatWaitsIsToldThatItsCommanderHasGone", {5, 3}, gone);

// The activity of B would end by itself, but not before anything else has happened.
void refused(const Explore& explore) {
  explore_anew<Commanded>(
      explore,
      [](Commanded& scene, Execution& execution) {
        execution.thread([&scene] {
          scene.input->core->refuse_peer(scene.b().core->instance(), kB);
          scene.b().signal();
        });
        execution.thread([&scene] { wait_for(scene, Waited::kIdle); });
        execution.finally([&scene] {
          require(scene.a().publish().discarded == 1, "what it inhibits is let through");
          require(scene.is_idle() && scene.idles() == 1, "it is not idle, or was told twice");
        });
      },
      b_overrides_a().timeout(kB, 1'000'000), depth(1));
}
const Register kRefused("AReceiverThatWaitsIsToldOfAWinnerWhoseConnectionIsRefused", {3, 2},
                        refused);

// The refusal comes only after the override, be it that it was on its way for long.
void refused_late(const Explore& explore) {
  explore_anew<Commanded>(
      explore,
      [](Commanded& scene, Execution& execution) {
        execution.thread([&scene] { scene.b().signal(); });
        execution.thread(
            [&scene] { scene.input->core->refuse_peer(scene.b().core->instance(), kB); });
        execution.thread([&scene] { wait_for(scene, Waited::kIdle); });
        execution.finally([&scene] { require(scene.idles() == 1, "it was told twice"); });
      },
      b_overrides_a().timeout(kB, 1'000'000), depth(1));
}
const Register kRefusedLate("ARefusalThatComesLateMakesAPortThatWaitsIdle", {2, 2}, refused_late);

// Another has the source, before or after the receiver has looked: its sample comes through, and
// the port is commanded again.
struct Reopened : Commanded {
  Reopened(const test::TableBuilder& model, const InputPortOptions& options)
      : Commanded(model, options) {
    input->last[kA] = 0;  // the successor counts its samples from 1
  }
  void open_again() {
    instance.bind(*successor, kA);
    instance.connect(*successor, *input);
    successor->publish();
  }
};

void opened_again(const Explore& explore) {
  explore_anew<Reopened>(
      explore,
      [](Reopened& scene, Execution& execution) {
        execution.thread([&scene] {
          scene.input->core->lose_peer(scene.a().core->instance());
          scene.open_again();
        });
        execution.thread([&scene] {
          Waited waited = scene.input->wait();
          if (waited == Waited::kIdle) waited = scene.input->wait();
          require(waited == Waited::kSample, "the successor's sample does not come");
          require(!scene.is_idle(), "it is idle, though its commander is back");
        });
        execution.finally([&scene] { require(scene.idles() <= 1, "it was told twice"); });
      },
      b_overrides_a(), depth(1));
}
const Register kAgain("ASourceThatIsOpenedAgainEndsTheIdleness", {2, 1}, opened_again);

// It may die at any operation. What it has delivered comes first; then the port is idle, once.
void dies(const Explore& explore) {
  explore_anew<Commanded>(
      explore,
      [](Commanded& scene, Execution& execution) {
        execution.mortal_thread([&scene] {
          scene.a().publish();
          scene.a().publish();
        });
        execution.thread([&scene] {
          wait_for_end_of(0);
          scene.input->core->lose_peer(scene.a().core->instance());
        });
        execution.thread([&scene] {
          while (scene.input->wait() != Waited::kIdle) {
          }
        });
        execution.finally([&scene] {
          require(scene.input->last[kA] >= scene.a().delivered, "what it delivered came too late");
          require(!scene.input->take(), "it was told before all was taken");
          require(scene.is_idle() && scene.idles() == 1, "it is not idle, or was told twice");
        });
      },
      b_overrides_a(), depth(2));
}
const Register kDies("ACommanderThatDiesMakesItsPortIdleOnceAllIsTaken", {1, 1, 1}, dies);

}  // namespace
}  // namespace arbiter::explore::idle_cases
