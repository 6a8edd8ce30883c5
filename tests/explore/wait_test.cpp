// No wake-up is lost between a receiver about to wait and a publisher (fences (b) and (d)).
#include <gtest/gtest.h>

#include "tests/explore/scenario.hpp"

namespace arbiter::explore {
namespace {

struct World {
  shm::Atomic<std::uint64_t> entry{0};
  shm::Atomic<std::uint64_t> wait{0};
  shm::Atomic<std::uint32_t> bell{0};  // the pipe: the kernel orders it

  void publish_fence() { shm::full_fence(); }  // (b)
  void wait_fence() { shm::full_fence(); }     // (d)

  void publish(std::uint64_t sequence, std::uint64_t& rung) {
    entry.store(sequence, std::memory_order_release);
    publish_fence();
    const std::uint64_t number = wait.load(std::memory_order_acquire);
    if ((number & 1) == 0 || number == rung) return;
    rung = number;
    bell.exchange(1);
  }
  std::uint64_t take() { return entry.load(std::memory_order_acquire); }

  // As InputCore::wait_once() has it.
  void wait_for(std::uint64_t sequence) {
    while (take() < sequence) {
      wait.store(wait.load(std::memory_order_relaxed) + 1, std::memory_order_release);
      wait_fence();
      if (take() < sequence) wait_until([this] { return bell.load() != 0; });
      wait.store(wait.load(std::memory_order_relaxed) + 1, std::memory_order_relaxed);
      bell.exchange(0);
    }
  }
};

Explorer::Scenario publish_to_a_waiter(World& world) {
  return [&world](Execution& execution) {
    world.entry.store(0);
    world.wait.store(0);
    world.bell.store(0);
    execution.thread([&world] {
      std::uint64_t rung = 0;
      for (std::uint64_t sequence = 1; sequence <= 2; ++sequence) world.publish(sequence, rung);
    });
    execution.thread([&world] {
      for (std::uint64_t sequence = 1; sequence <= 2; ++sequence) world.wait_for(sequence);
    });
  };
}

TEST(WaitInterleavings, NoWakeUpIsLost) {
  World world;
  constexpr Limits kLimits{5, 3};
  const auto scenario = publish_to_a_waiter(world);
  expect_holds("waiting", kLimits, scenario);
  expect_fails_without("fence (b)", kLimits, {Weakness::kFullFence, "publish_fence"}, scenario);
  expect_fails_without("fence (d)", kLimits, {Weakness::kFullFence, "wait_fence"}, scenario);
}

}  // namespace
}  // namespace arbiter::explore
