// What happens between two loads of a take: tried between any two of them.
#include <gtest/gtest.h>

#include <cstdint>
#include <functional>
#include <utility>
#include <vector>

#include "tests/fuzz/segments/seam.hpp"
#include "tests/fuzz/segments/world.hpp"

namespace {

using arbiter::fuzz::Seam;
using arbiter::fuzz::World;

// Does something, once, before the operation of that number.
class Interrupter : public Seam {
 public:
  Interrupter(std::uint64_t at, std::function<void()> action)
      : at_(at), action_(std::move(action)) {
    current = this;
  }
  ~Interrupter() override { current = nullptr; }

  [[nodiscard]] bool has_acted() const { return acted_; }
  std::uint64_t load(const void*, std::uint64_t value, std::size_t) override { return value; }
  void before_operation() override {
    if (acted_ || count_++ != at_) return;
    acted_ = true;
    current = nullptr;
    action_();
    current = this;
  }

 private:
  std::uint64_t at_;
  std::function<void()> action_;
  std::uint64_t count_ = 0;
  bool acted_ = false;
};

// The number of the sample of /p that is taken; 0: one of /h; -1: none.
std::int64_t take(World& world) {
  const auto sample = world.r.take();
  if (sample.data == nullptr) return -1;
  const auto number = static_cast<std::int64_t>(world.require_whole(sample));
  world.r.give_back(sample.hold);
  return number;
}

// Four samples of /p wait when an override comes, with a sample of its own. While the take drops
// the four, one more is published and pushes the oldest out. Once the override's sample is taken,
// none of the four may come any more.
TEST(ATake, DropsAllThatIsOlderThanItsSampleEvenIfItIsOvertakenMeanwhile) {
  constexpr std::uint32_t kDepth = 4;
  bool acted = true;
  std::uint64_t at = 0;
  for (; acted; ++at) {
    SCOPED_TRACE("before operation " + std::to_string(at));
    World world({.depth = kDepth, .refuse_new = false, .timeouts = false});
    for (std::uint32_t i = 0; i < kDepth; ++i) world.publish(world.p, false, 1);
    world.s.signal(arbiter::shm::monotonic_now());
    world.publish(world.h, false, 1);
    std::vector<std::int64_t> taken;
    {
      Interrupter interrupter(at, [&] {
        world.s.deactivate(arbiter::shm::monotonic_now());
        world.publish(world.p, false, 1);
        world.s.signal(arbiter::shm::monotonic_now());
      });
      taken.push_back(take(world));
      acted = interrupter.has_acted();
    }
    world.s.deactivate(arbiter::shm::monotonic_now());
    for (std::int64_t next = 0; (next = take(world)) >= 0;) taken.push_back(next);
    bool overridden = false;
    for (const std::int64_t number : taken) {
      overridden = overridden || number == 0;
      if (!overridden || number == 0) continue;
      EXPECT_GT(number, kDepth) << "after the override's";
    }
    world.require_accounts();
  }
  EXPECT_GT(at, 50u);
}

}  // namespace
