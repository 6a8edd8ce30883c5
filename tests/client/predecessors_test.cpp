// A receiver that does not take keeps no more of the publishers that are gone than its queue holds.
#include <gtest/gtest.h>

#include <algorithm>
#include <atomic>
#include <fstream>
#include <functional>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include <arbiter/arbiter.hpp>

#include "tests/client/component.hpp"
#include "tests/client/models.hpp"
#include "tests/client/samples.hpp"
#include "tests/support/daemon.hpp"

namespace arbiter::test {
namespace {

// Mappings of output ports' segments in this process.
std::size_t mapped_outputs() {
  std::ifstream maps("/proc/self/maps");
  std::size_t count = 0;
  for (std::string line; std::getline(maps, line);) {
    count += line.find("/memfd:arbiter-output") != std::string::npos ? 1 : 0;
  }
  return count;
}

// The publishers are in another process, or their own mappings would count.
struct Restarts {
  explicit Restarts(const InputPortOptions& options)
      : in(node.input_port<Number>("/in", options)), sender("sender") {}

  // Publishers one after the other, each of which publishes as many samples as is said.
  void restart(
      int times, std::int64_t samples, const std::function<void()>& meanwhile = [] {}) {
    for (int i = 0; i < times; ++i) {
      ASSERT_EQ(sender.tell("output /out"), "open");
      if (samples != 0) {
        ASSERT_EQ(
            sender.tell("publish /out " + std::to_string(next) + " " + std::to_string(samples)),
            "1 0 0");
      }
      next += samples;
      meanwhile();
      most_mapped = std::max(most_mapped, mapped_outputs());
      ASSERT_EQ(sender.tell("close /out"), "closed");
    }
  }
  // Every sample that was accepted has been taken, or counted as lost.
  void expect_balance(std::uint64_t taken) {
    while (in.take()) ++taken;
    const auto counters = daemon.input("/in");
    EXPECT_EQ(counters["taken"].get<std::uint64_t>(), taken);
    EXPECT_EQ(counters["overtaken"].get<std::uint64_t>() + taken,
              static_cast<std::uint64_t>(next - 1));
    EXPECT_EQ(counters["dropped"], 0);
  }

  Daemon daemon{single_model()};
  Node node{"test"};
  InputPort<Number> in;
  Component sender;
  std::int64_t next = 1;  // sample
  std::size_t most_mapped = 0;
};

TEST(Predecessors, OfThousandsAReceiverThatDoesNotTakeKeepsAsManyAsItsQueueHolds) {
  Restarts scene({.depth = 4});
  scene.restart(2000, 1);
  EXPECT_LE(scene.most_mapped, 4u + 2);
  const auto taken = take_all(scene.in);
  EXPECT_EQ(taken, (std::vector<std::int64_t>{1997, 1998, 1999, 2000}));
  scene.expect_balance(taken.size());
}

TEST(Predecessors, WhatIsLeftIsTheEndOfTheConnectionsQueue) {
  Restarts scene({.depth = 4});
  scene.restart(30, 3);
  EXPECT_LE(scene.most_mapped, 4u);
  const auto taken = take_all(scene.in);
  EXPECT_EQ(taken, (std::vector<std::int64_t>{87, 88, 89, 90}));
  scene.expect_balance(taken.size());
}

TEST(Predecessors, ThoseThatHavePublishedNothingAreLetGoOfAtOnce) {
  Restarts scene({.depth = 1024});
  scene.restart(1, 2);
  scene.restart(200, 0);
  EXPECT_LE(scene.most_mapped, 3u);
  EXPECT_EQ(take_all(scene.in), (std::vector<std::int64_t>{1, 2}));
}

TEST(Predecessors, OfADeepQueueTheLatestArePreservedAndTheOthersCounted) {
  Restarts scene({.depth = 1024});
  scene.restart(400, 1);
  EXPECT_LE(scene.most_mapped, 256u + 2);
  const auto taken = take_all(scene.in);
  EXPECT_GE(taken.size(), 256u);
  EXPECT_LE(taken.size(), 257u) << "it may not have heard of the last one's end";
  EXPECT_EQ(taken.back(), 400);
  EXPECT_EQ(taken.front(), 401 - static_cast<std::int64_t>(taken.size()));
  scene.expect_balance(taken.size());
}

// It takes up each new publisher, and looks at no queue.
TEST(Predecessors, AReceiverThatOnlyAsksWhoCommandsKeepsNoMore) {
  Restarts scene({.depth = 2});
  scene.restart(100, 1, [&] { EXPECT_FALSE(scene.in.idle()); });
  EXPECT_LE(scene.most_mapped, 2u + 3);
  const auto taken = take_all(scene.in);
  EXPECT_EQ(taken, (std::vector<std::int64_t>{99, 100}));
  scene.expect_balance(taken.size());
}

TEST(Predecessors, ASampleThatIsHeldOutlivesThem) {
  Restarts scene({.depth = 2, .max_held = 2});
  scene.restart(1, 3);
  auto held = scene.in.take();
  ASSERT_TRUE(held);
  scene.restart(50, 5);
  EXPECT_EQ((**held).value, 2) << "of the first publisher";
  EXPECT_LE(scene.most_mapped, 5u);
  const auto taken = take_all(scene.in);
  EXPECT_EQ(taken, (std::vector<std::int64_t>{252, 253}));
  EXPECT_EQ((**held).value, 2);
  held.reset();
  scene.expect_balance(taken.size() + 1);
}

// Of the five only the last two are in its ring still, and two later ones push these out.
TEST(Predecessors, WhatWasOvertakenByItsOwnPublisherDoesNotGiveWayInsteadOfTheRest) {
  Restarts scene({.depth = 2});
  scene.restart(1, 5);
  ASSERT_EQ(scene.sender.tell("output /out"), "open");
  EXPECT_EQ(scene.sender.tell("publish /out 6 2"), "1 0 0");
  scene.next += 2;
  const auto taken = take_all(scene.in);
  EXPECT_EQ(taken, (std::vector<std::int64_t>{6, 7}));
  scene.expect_balance(taken.size());
}

// The successor rings nobody: the service thread looks by itself.
TEST(Predecessors, WhatALivingSuccessorPushesOutIsLetGoOfToo) {
  Restarts scene({.depth = 3});
  scene.restart(3, 1);
  ASSERT_EQ(scene.sender.tell("output /out"), "open");
  EXPECT_EQ(mapped_outputs(), 4u);
  EXPECT_EQ(scene.sender.tell("publish /out 4 3"), "1 0 0");
  scene.next += 3;
  while (mapped_outputs() != 1) std::this_thread::yield();
  const auto taken = take_all(scene.in);
  EXPECT_EQ(taken, (std::vector<std::int64_t>{4, 5, 6}));
  scene.expect_balance(taken.size());
}

// A new publisher is not refused for what an old one has left: the oldest give way, counted.
TEST(Predecessors, APortThatRefusesHasOneQueueForThemAllToo) {
  Restarts scene({.depth = 4, .when_full = refuse_new});
  scene.restart(300, 2);
  EXPECT_LE(scene.most_mapped, 4u);
  const auto taken = take_all(scene.in);
  EXPECT_EQ(taken, (std::vector<std::int64_t>{597, 598, 599, 600}));
  scene.expect_balance(taken.size());
}

TEST(Predecessors, WhileTheComponentTakesNoneIsCountedTwiceOrNotAtAll) {
  Restarts scene({.depth = 2});
  std::atomic<bool> ends{false};
  std::uint64_t taken = 0;
  std::int64_t last = 0;
  std::thread receiver([&] {
    while (!ends) {
      const auto sample = scene.in.take();
      if (!sample) continue;
      EXPECT_GT((**sample).value, std::exchange(last, (**sample).value));
      ++taken;
    }
  });
  scene.restart(300, 3);
  ends = true;
  receiver.join();
  scene.expect_balance(taken);
}

}  // namespace
}  // namespace arbiter::test
