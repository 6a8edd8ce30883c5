// After set-up the data path makes no system call but the wake-up, no page fault, no allocation:
// the receiver's half.
//
// Here "after set-up" is after a call that found nothing.
#include <gtest/gtest.h>
#include <sys/syscall.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <climits>
#include <fstream>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "tests/client/models.hpp"
#include "tests/client/samples.hpp"
#include "tests/realtime/data_path_thread.hpp"
#include "tests/support/daemon.hpp"
#include "tests/support/threads.hpp"

namespace arbiter::test {
namespace {

using namespace std::chrono_literals;

constexpr std::int64_t kMoreThanSlots = 200;  // more than any pool here has slots

// How much of our mappings of output ports is resident, in KiB: the largest one, or the smallest.
struct Resident {
  long most = 0;
  long least = LONG_MAX;
};
Resident resident_output_ports(const std::string& access) {
  Resident resident;
  std::ifstream maps("/proc/self/smaps");
  bool is_wanted = false;
  for (std::string line; std::getline(maps, line);) {
    if (line.find('-') < line.find(' ')) {
      is_wanted = line.find(access) != std::string::npos &&
                  line.find("/memfd:arbiter-output") != std::string::npos;
    } else if (is_wanted && line.rfind("Rss:", 0) == 0) {
      const long kib = std::stol(line.substr(4));
      resident = {std::max(resident.most, kib), std::min(resident.least, kib)};
    }
  }
  return resident;
}

// One or more sources at a port, all selected by turns: each overrides those before it.
class RealTimeTake : public testing::Test {
 protected:
  struct Scene {
    explicit Scene(int sources, InputPortOptions options = {}, const std::string& timeout = "1h")
        : daemon(model(sources, timeout)), in(receiver.input_port<Number>("/in", options)) {
      for (int i = 0; i < sources; ++i) {
        out.push_back(sender.output_port<Number>("/out" + std::to_string(i)));
      }
    }
    static std::string model(int sources, const std::string& timeout) {
      std::string selects;
      for (int i = 0; i < sources; ++i) {
        std::string condition;
        for (int other = i + 1; other < sources; ++other) {
          condition += (condition.empty() ? "not /out" : " and not /out") + std::to_string(other);
        }
        selects += select("/out" + std::to_string(i), condition);
      }
      return rules(arbiter_at("/in", selects), timeout == "1h" ? "3600s" : timeout);
    }
    Daemon daemon;
    Node sender{"sender"};
    Node receiver{"receiver"};
    InputPort<Number> in;
    std::vector<OutputPort<Number>> out;
  };

  void set_up(Scene& scene) {
    thread.run([&] { EXPECT_FALSE(scene.in.wait_for(1ms)); });  // forgets that peers came
    for (auto& out : scene.out) out.deactivate();
  }

  DataPathThread thread;
};

// Every slot of the publisher's pool comes by.
TEST_F(RealTimeTake, SamplesCostNothingFromTheFirstOn) {
  Scene scene(1);
  set_up(scene);
  for (std::int64_t i = 0; i < kMoreThanSlots; ++i) {
    scene.out[0].publish(Number{i});
    std::int64_t value = kNothing;
    EXPECT_EQ(thread.costs_of([&] { value = take_from(scene.in); }), kNone) << i;
    EXPECT_EQ(value, i);
  }
}

TEST_F(RealTimeTake, EmptyQueuesCostNothing) {
  Scene scene(8);
  set_up(scene);
  EXPECT_EQ(thread.costs_of([&] {
    for (int i = 0; i < 1000; ++i) EXPECT_FALSE(scene.in.take());
  }),
            kNone);
}

TEST_F(RealTimeTake, SeveralSourcesCostNothing) {
  Scene scene(8);
  set_up(scene);
  for (auto& out : scene.out) EXPECT_EQ(out.publish(Number{1}).delivered, 1u);
  // All but the last have been overridden since: they are dropped here.
  EXPECT_EQ(thread.costs_of([&] {
    EXPECT_TRUE(scene.in.take());
    EXPECT_FALSE(scene.in.take());
  }),
            kNone);
  EXPECT_EQ(scene.daemon.input("/in")["dropped"], 7);
}

TEST_F(RealTimeTake, ReceiversThatWereOvertakenPayNothing) {
  Scene scene(1, {.depth = 2});
  set_up(scene);
  for (std::int64_t i = 0; i < kMoreThanSlots; ++i) scene.out[0].publish(Number{i});
  std::int64_t value = kNothing;
  EXPECT_EQ(thread.costs_of([&] { value = take_from(scene.in); }), kNone);
  EXPECT_EQ(value, kMoreThanSlots - 2);
}

TEST_F(RealTimeTake, HeldSamplesCostNothing) {
  Scene scene(1, {.max_held = 4});
  set_up(scene);
  for (std::int64_t i = 0; i < 8; ++i) scene.out[0].publish(Number{i});
  EXPECT_EQ(thread.costs_of([&] {
    const auto first = scene.in.take();
    const auto second = scene.in.take();
    const auto third = scene.in.take();
    EXPECT_EQ((**third).value, 2);
  }),
            kNone);
}

// The winner's own commander runs out between two takes: the second drops.
TEST_F(RealTimeTake, ActivityThatRunsOutCostsNothing) {
  Scene scene(2, {}, "20ms");
  set_up(scene);
  thread.run([&] {
    scene.out[1].signal();
    scene.out[1].deactivate();
  });
  EXPECT_EQ(scene.out[0].publish(Number{1}).delivered, 1u);
  std::uint64_t denied = 0;
  EXPECT_EQ(thread.costs_of([&] {
    while (denied == 0) {  // it may not run for longer than T
      scene.out[1].signal();
      for (;;) {
        const auto sample = scene.in.take();
        if (sample || scene.in.idle()) break;
        ++denied;
      }
    }
  }),
            kNone);
}

// The names are longer than any that a string would hold without an allocation.
TEST_F(RealTimeTake, NamesOfSourcesCostNothing) {
  const std::string name = "/a/source/whose/name/is/too/long/to/be/kept/in/a/string";
  Daemon daemon(rules(arbiter_at("/in", select(name))));
  Node sender("sender");
  Node receiver("receiver");
  auto in = receiver.input_port<Number>("/in");
  auto out = sender.output_port<Number>(name);
  thread.run([&] { EXPECT_FALSE(in.wait_for(1ms)); });
  out.publish(Number{1});
  const std::string* source = nullptr;
  std::optional<std::string_view> winner;
  EXPECT_EQ(thread.costs_of([&] {
    const auto sample = in.take();
    source = &sample->source();
    winner = in.winner();
  }),
            kNone);
  EXPECT_EQ(*source, name);
  EXPECT_EQ(winner, name);
  // They stay as they are, whatever is named since.
  daemon.load(rules(arbiter_at("/in", select(name, "not /one and not /two"))));
  EXPECT_EQ(*source, name);
  EXPECT_EQ(winner, name);
}

TEST_F(RealTimeTake, WaitingForASampleThatIsThereCostsNothing) {
  Scene scene(1);
  set_up(scene);
  scene.out[0].publish(Number{1});
  EXPECT_EQ(thread.costs_of([&] { EXPECT_TRUE(scene.in.wait_for(1h)); }), kNone);
}

// To sleep, and to forget the ring.
TEST_F(RealTimeTake, WaitingCostsASleep) {
  Scene scene(1);
  set_up(scene);
  thread.begin([&] { EXPECT_TRUE(scene.in.wait_for(1h)); });
  // It sleeps in seccomp's hands first: the call itself comes after.
  wait_until_it_polls(::getpid(), thread.task());
  scene.out[0].publish(Number{1});
  EXPECT_EQ(thread.end(), (Costs{{SYS_ppoll, SYS_read}, 0, 0}));
}

TEST_F(RealTimeTake, ATimeLimitCostsASleep) {
  Scene scene(1);
  set_up(scene);
  const Costs costs = thread.costs_of([&] { EXPECT_FALSE(scene.in.wait_for(1s)); });
  EXPECT_EQ(costs, (Costs{{SYS_ppoll, SYS_read}, 0, 0}));
}

// Another receiver makes the publisher use more of its memory. Ours hears of it soon after; then
// that memory costs it no more than the rest.
TEST_F(RealTimeTake, AnotherReceiverOfTheSamePublisherCostsNothingOnceItHasSettled) {
  Daemon daemon(fan_out_model(2));
  Node sender("sender");
  Node receiver("receiver");
  auto out = sender.output_port<std::array<char, 100'000>>("/out");
  auto in = receiver.input_port<std::array<char, 100'000>>("/in0", {.depth = 1});
  thread.run([&] { EXPECT_FALSE(in.wait_for(1ms)); });
  auto other = receiver.input_port<std::array<char, 100'000>>("/in1", {.depth = 32});
  const long in_use = resident_output_ports("rw-s").most;
  EXPECT_GT(in_use, 3300);
  while (resident_output_ports("r--s").least < in_use) {
  }
  for (int i = 0; i < 50; ++i) {
    auto loan = out.loan();
    ASSERT_TRUE(loan);
    EXPECT_EQ(out.publish(std::move(*loan)).delivered, 2u);
    int sum = 0;
    EXPECT_EQ(thread.costs_of([&] {
      const auto sample = in.take();
      for (const char byte : **sample) sum += byte;
    }),
              kNone)
        << i;
  }
}

TEST_F(RealTimeTake, LargeSamplesFaultNowhere) {
  Daemon daemon(single_model());
  Node sender("sender");
  Node receiver("receiver");
  auto out = sender.output_port<Image>("/out");
  auto in = receiver.input_port<Image>("/in", {.depth = 2});
  thread.run([&] { EXPECT_FALSE(in.take()); });
  for (int i = 0; i < 10; ++i) {
    auto loan = out.loan();
    ASSERT_TRUE(loan);
    (*loan)->bytes.fill(static_cast<unsigned char>(i));
    out.publish(std::move(*loan));
    int sum = 0;
    EXPECT_EQ(thread.costs_of([&] {
      const auto sample = in.take();
      for (const unsigned char byte : (*sample)->bytes) sum += byte;
    }),
              kNone);
    EXPECT_EQ(sum, i << 22);
  }
}

}  // namespace
}  // namespace arbiter::test
