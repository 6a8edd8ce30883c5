// After set-up the data path makes no system call but the wake-up, no page fault, no allocation:
// the publisher's half.
//
// "After set-up" is after the first call that takes up what the service thread has mapped; here it
// is a signal(), so that the first sample, and each slot of the pool, is used for the first time
// under watch.
#include <gtest/gtest.h>
#include <sys/syscall.h>

#include <memory>
#include <optional>
#include <utility>

#include "tests/client/models.hpp"
#include "tests/client/samples.hpp"
#include "tests/realtime/data_path_thread.hpp"
#include "tests/support/daemon.hpp"
#include "tests/support/hear_all.hpp"
#include "tests/support/threads.hpp"

namespace arbiter::test {
namespace {

// More than any pool here has slots.
constexpr int kManySamples = 200;

const std::vector<int> kWakeUp{SYS_rt_sigprocmask, SYS_write, SYS_rt_sigprocmask};

class RealTimePublish : public testing::Test {
 protected:
  DataPathThread thread;

  // Two sources at one port, of which `high` overrides.
  struct Override {
    explicit Override(const std::string& timeout = "forever") : daemon(override_model(timeout)) {}
    Daemon daemon;
    Node node{"test"};
    InputPort<Number> in = node.input_port<Number>("/in", {.depth = 16});
    OutputPort<Number> low = node.output_port<Number>("/low");
    OutputPort<Number> high = node.output_port<Number>("/high");
    OutputPort<Number> stop = node.output_port<Number>("/stop");
  };

  // How many were delivered.
  template <class Port>
  static std::uint32_t publish_many(Port& port) {
    std::uint32_t delivered = 0;
    for (int i = 0; i < kManySamples; ++i) delivered += port.publish(Number{i}).delivered;
    return delivered;
  }
};

TEST_F(RealTimePublish, TheWatcherSeesWhatItIsFor) {
  const auto page = std::make_unique<Image>();
  void* fresh = nullptr;
  EXPECT_EQ(thread.costs_of([] {}), kNone);
  EXPECT_EQ(thread.costs_of([] { ::syscall(SYS_getppid); }).system_calls,
            std::vector<int>{SYS_getppid});
  EXPECT_GE(thread.costs_of([&] { fresh = ::operator new(100); }).allocations, 1u);
  EXPECT_GE(thread.costs_of([&] { ::operator delete(fresh); }).allocations, 1u);
  const auto segment = shm::make_segment("test", 1 << 20);
  const shm::Mapping mapping(segment, 1 << 20, shm::Access::kReadWrite);
  EXPECT_GE(thread.costs_of([&] { *mapping.as<int>() = 1; }).page_faults, 1);
}

TEST_F(RealTimePublish, WinnersCostNothingFromTheFirstSampleOn) {
  Override scene;
  thread.run([&] { scene.low.signal(); });
  std::uint32_t delivered = 0;
  EXPECT_EQ(thread.costs_of([&] { delivered = publish_many(scene.low); }), kNone);
  EXPECT_EQ(delivered, kManySamples);
}

TEST_F(RealTimePublish, LosersCostNothing) {
  Override scene;
  thread.run([&] {
    scene.high.signal();
    scene.low.signal();
  });
  std::uint32_t delivered = 1;
  EXPECT_EQ(thread.costs_of([&] { delivered = publish_many(scene.low); }), kNone);
  EXPECT_EQ(delivered, 0u);
}

TEST_F(RealTimePublish, RefusedSamplesCostNothing) {
  Daemon daemon(single_model());
  Node node("test");
  auto in = node.input_port<Number>("/in", {.depth = 4, .when_full = refuse_new});
  auto out = node.output_port<Number>("/out");
  thread.run([&] { out.signal(); });
  std::uint32_t delivered = 0;
  EXPECT_EQ(thread.costs_of([&] { delivered = publish_many(out); }), kNone);
  EXPECT_EQ(delivered, 4u);
}

TEST_F(RealTimePublish, PortsThatNoRuleMentionsCostNothing) {
  Daemon::Options options;
  options.application = application(connection("/out", "/in"));
  Daemon daemon(kNoRules, options);
  Node node("test");
  auto in = node.input_port<Number>("/in");
  auto out = node.output_port<Number>("/out");
  auto alone = node.output_port<Number>("/alone");
  thread.run([&] {
    out.signal();
    alone.signal();
  });
  std::uint32_t delivered = 0;
  EXPECT_EQ(thread.costs_of([&] {
    delivered = publish_many(out);
    publish_many(alone);
  }),
            kNone);
  EXPECT_EQ(delivered, kManySamples);
}

// Of their 8211 slots, up to 7680 wait to be used again: the lists of them grow by many pages.
TEST_F(RealTimePublish, ManyDestinationsCostNothing) {
  constexpr int kPorts = 16;
  constexpr int kSamples = 20000;
  Daemon daemon(fan_out_model(kPorts));
  Node node("test");
  std::vector<InputPort<Number>> in;
  for (int i = 0; i < kPorts; ++i) {
    in.push_back(node.input_port<Number>("/in" + std::to_string(i), {.depth = 512}));
  }
  auto out = node.output_port<Number>("/out");
  thread.run([&] { out.signal(); });
  std::uint32_t delivered = 0;
  EXPECT_EQ(thread.costs_of([&] {
    for (int i = 0; i < kSamples; ++i) delivered += out.publish(Number{i}).delivered;
  }),
            kNone);
  EXPECT_EQ(delivered, kPorts * kSamples);
}

// A receiver that holds samples keeps their slots from being used again.
TEST_F(RealTimePublish, SamplesThatAreHeldCostThePublisherNothing) {
  Daemon daemon(single_model());
  Node node("test");
  auto in = node.input_port<Number>("/in", {.max_held = 64});
  auto out = node.output_port<Number>("/out");
  std::vector<Sample<Number>> held;
  for (int i = 0; i < 64; ++i) {
    out.publish(Number{i});
    held.push_back(std::move(*in.take()));
  }
  std::uint32_t delivered = 0;
  EXPECT_EQ(thread.costs_of([&] { delivered = publish_many(out); }), kNone);
  EXPECT_EQ(delivered, kManySamples);
}

TEST_F(RealTimePublish, LoansCostNothingPublishedOrNot) {
  Override scene;
  thread.run([&] { scene.low.signal(); });
  EXPECT_EQ(thread.costs_of([&] {
    for (int i = 0; i < kManySamples; ++i) {
      auto published = scene.low.loan();
      auto given_up = scene.low.loan();
      const auto beyond = scene.low.loan();
      EXPECT_FALSE(beyond);
      (*published)->value = i;
      EXPECT_EQ(scene.low.publish(std::move(*published)).delivered, 1u);
    }
  }),
            kNone);
}

TEST_F(RealTimePublish, SignalsAndDeactivationsCostNothing) {
  Override scene;
  thread.run([&] { scene.high.signal(); });
  EXPECT_EQ(thread.costs_of([&] {
    for (int i = 0; i < kManySamples; ++i) {
      scene.high.signal();
      scene.high.deactivate();
    }
  }),
            kNone);
}

// An override runs out while a loser publishes: the decision needs the time, and gets it without a
// call.
TEST_F(RealTimePublish, ActivityThatRunsOutCostsNothing) {
  Override scene("20ms");
  thread.run([&] {
    scene.high.signal();
    scene.low.signal();
  });
  std::uint32_t lost = 0;
  EXPECT_EQ(thread.costs_of([&] {
    while (lost == 0) {  // it may not run for longer than T
      scene.high.signal();
      while (scene.low.publish(Number{1}).delivered == 0) ++lost;
    }
  }),
            kNone);
}

// 4 MiB, written in place, in every slot of the pool.
TEST_F(RealTimePublish, LargeSamplesFaultNowhere) {
  Daemon daemon(single_model());
  Node node("test");
  auto in = node.input_port<Image>("/in", {.depth = 2});
  auto out = node.output_port<Image>("/out");
  thread.run([&] { out.signal(); });
  EXPECT_EQ(thread.costs_of([&] {
    for (int i = 0; i < 10; ++i) {
      auto loan = out.loan();
      (*loan)->bytes.fill(1);
      out.publish(std::move(*loan));
    }
  }),
            kNone);
}

TEST_F(RealTimePublish, AReceiverThatWaitsCostsItsWakeUpOnce) {
  Override scene;
  thread.run([&] { scene.low.signal(); });
  Watched waiter([&] { EXPECT_TRUE(scene.in.wait_for(std::chrono::hours(1))); });
  waiter.wait_until_asleep();
  EXPECT_EQ(thread.costs_of([&] { scene.low.publish(Number{1}); }), (Costs{kWakeUp, 0, 0}));
  waiter.join();
  EXPECT_EQ(thread.costs_of([&] { scene.low.publish(Number{2}); }), kNone);
}

// From the first event on, and round the ring of events: that has 1024.
TEST_F(RealTimePublish, WhatIsTappedCostsNothing) {
  Override scene;
  auto tap = scene.node.tap<Number>("/low", {.may_wait = false});
  thread.run([&] { scene.low.signal(); });
  std::uint32_t delivered = 0;
  EXPECT_EQ(thread.costs_of([&] {
    for (int i = 0; i < 6; ++i) delivered += publish_many(scene.low);
  }),
            kNone);
  EXPECT_EQ(delivered, 6 * kManySamples);
  EXPECT_TRUE(tap.take());
}

TEST_F(RealTimePublish, ATapThatWaitsCostsItsWakeUpOnce) {
  Override scene;
  auto tap = scene.node.tap<Number>("/low");
  thread.run([&] { scene.low.signal(); });
  while (tap.take()) {
  }
  Watched waiter([&] { EXPECT_TRUE(tap.wait_for(std::chrono::hours(1))); });
  waiter.wait_until_asleep();
  EXPECT_EQ(thread.costs_of([&] { scene.low.publish(Number{1}); }), (Costs{kWakeUp, 0, 0}));
  waiter.join();
  EXPECT_EQ(thread.costs_of([&] { scene.low.publish(Number{2}); }), kNone);
}

TEST_F(RealTimePublish, WhoTapsPaysNothingForEachEvent) {
  Override scene;
  auto tap = scene.node.tap<Number>("/low");
  thread.run([&] {
    scene.low.signal();
    while (tap.take()) {
    }
  });
  for (int i = 0; i < 60; ++i) scene.low.publish(Number{i});
  int taken = 0;
  EXPECT_EQ(thread.costs_of([&] {
    while (taken < 60 && tap.take()) ++taken;
  }),
            kNone);
  EXPECT_EQ(taken, 60);
}

// The tables are there before they count, and so is what a new rule reads.
TEST_F(RealTimePublish, AModelThatComesIntoForceFaultsNowhere) {
  Override scene;
  auto other = scene.node.output_port<Number>("/other");
  thread.run([&] {
    scene.low.signal();
    static_cast<void>(scene.in.take());
  });
  const std::string selects[]{select("/low", "not /high"), select("/low", "not /other")};
  for (int i = 0; i < 20; ++i) {
    scene.daemon.load(rules(arbiter_at("/in", selects[i % 2])));
    hear_all(scene.node);
    const Costs costs = thread.costs_of([&] {
      EXPECT_EQ(scene.low.publish(Number{i}).delivered, 1u);
      EXPECT_TRUE(scene.in.take());
    });
    EXPECT_EQ(costs.page_faults, 0) << i;
  }
}

}  // namespace
}  // namespace arbiter::test
