// What the threads of a gateway tell each other: when the process ran
// (gateway/core/run_record.hpp), and what has been made (gateway/core/announced.hpp).
#include "gateway/core/announced.hpp"
#include "gateway/core/run_record.hpp"
#include "tests/explore/components.hpp"

namespace arbiter::explore::gateway_cases {
namespace {

using gateway::Announced;
using gateway::RunRecord;

// It ticks every 100; the last tick before the stall is at 1100, the first behind it at 5000.
struct Stalled {
  Stalled() {
    record.tick(1000, 100);
    record.tick(1100, 100);
  }
  RunRecord record;
};

void stall(const Explore& explore) {
  explore_anew<Stalled>(explore, [](Stalled& scene, Execution& execution) {
    execution.thread([&scene] {
      scene.record.tick(5000, 100);
      scene.record.tick(5100, 100);
    });
    execution.thread([&scene] {
      require(scene.record.since(5101) <= 1100, "what has waited is taken for fresh");
      require(scene.record.since(1101) <= 1100, "what has waited is taken for fresh");
    });
    execution.finally([&scene] {
      require(scene.record.since(6299) == 1100, "the backlog is over too early");
      require(scene.record.since(6300) == 5100, "the backlog is not over");
    });
  });
}
const Register kStall("WhatHasWaitedWhileAGatewayWasStoppedIsNeverTakenForFresh", {4, 3}, stall);

struct Making {
  shm::Atomic<std::uint64_t> made{0};
  Announced<shm::Atomic<std::uint64_t>> announced;
};

void announce(const Explore& explore) {
  explore_anew<Making>(explore, [](Making& scene, Execution& execution) {
    execution.thread([&scene] {
      scene.made.store(1, std::memory_order_relaxed);
      scene.announced.announce(scene.made);
    });
    execution.thread([&scene] {
      const auto* const made = scene.announced.get();
      require(made == nullptr || made->load(std::memory_order_relaxed) == 1,
              "it is used before it is made");
    });
  });
}
const Register kAnnounced("WhatIsAnnouncedIsFoundMade", {4, 3}, announce);

}  // namespace
}  // namespace arbiter::explore::gateway_cases
