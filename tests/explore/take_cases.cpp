// publish() and take(), the ports' own (client/): slots, takeover, decisions at both ends.
#include "tests/explore/case.hpp"
#include "tests/explore/components.hpp"

namespace arbiter::explore {
namespace {

InputPortOptions depth(std::uint32_t samples) {
  InputPortOptions options;
  options.depth = samples;
  return options;
}

// A publisher, a receiver, a full queue, samples overtaken already, and no slot to spare.
struct OneToOne {
  explicit OneToOne(const InputPortOptions& options)
      : instance(forever().connect({kA, kPort, shm::table::kAlways, {}, {}})),
        a(instance.make_output()),
        input(instance.make_input(kPort, options)) {
    instance.bind(*a, kA);
    instance.connect(*a, *input);
    for (std::uint32_t i = 0; i <= options.depth; ++i) a->publish();
    input->take();
    a->publish();
  }

  Instance instance;
  std::unique_ptr<Output> a;
  std::unique_ptr<Input> input;
};

void publish_and_take(const Explore& explore, std::uint32_t samples, int publishes, int takes) {
  Restored<OneToOne> world(depth(samples));
  explore([&](Execution& execution) {
    OneToOne& now = world.restore();
    execution.thread([&now, publishes] {
      for (int i = 0; i < publishes; ++i) now.a->publish();
    });
    execution.thread([&now, takes] {
      for (int i = 0; i < takes; ++i) now.input->take();
    });
    execution.finally([&now] {
      while (now.input->take()) {
      }
      require(now.input->last[kA] == now.a->published, "the newest sample is not there");
      const auto overtaken = now.input->counters().overtaken.load(std::memory_order_relaxed);
      require(now.input->taken[kA] + overtaken == now.a->published, "the account does not balance");
    });
  });
}

const Register kDepth1("NoSampleIsWrittenWhileItIsReadWithDepth1", {3, 2},
                       [](const Explore& explore) { publish_and_take(explore, 1, 2, 2); });
const Register kDepth2("NoSampleIsWrittenWhileItIsReadWithDepth2", {3, 2},
                       [](const Explore& explore) { publish_and_take(explore, 2, 3, 2); });

}  // namespace
}  // namespace arbiter::explore
