// What once went wrong between publish() and take(), and must not again.
#include <gtest/gtest.h>

#include <atomic>
#include <chrono>
#include <functional>
#include <string>
#include <thread>
#include <vector>

#include <arbiter/arbiter.hpp>

#include "tests/client/models.hpp"
#include "tests/client/samples.hpp"
#include "tests/support/daemon.hpp"
#include "tests/support/hear_all.hpp"
#include "tests/support/threads.hpp"

namespace arbiter::test {
namespace {

TEST(DataPath, AConnectionThatComesBackGivesNothingThatWasTakenBefore) {
  Daemon daemon(single_model());
  Node node("test");
  auto out = node.output_port<Number>("/out");
  auto in = node.input_port<Number>("/in");
  for (int i = 1; i <= 3; ++i) EXPECT_EQ(out.publish(Number{i}).delivered, 1u);
  EXPECT_EQ(take_all(in), (std::vector<std::int64_t>{1, 2, 3}));
  daemon.load(kNoRules);
  hear_all(node);
  EXPECT_FALSE(in.take());
  daemon.load(single_model());
  hear_all(node);
  EXPECT_EQ(take_all(in), (std::vector<std::int64_t>{}));
  EXPECT_EQ(out.publish(Number{4}).delivered, 1u);
  EXPECT_EQ(take_all(in), (std::vector<std::int64_t>{4}));
  EXPECT_EQ(out.publish(Number{5}).delivered, 1u);
  EXPECT_EQ(take_all(in), (std::vector<std::int64_t>{5}));
}

TEST(DataPath, PublishersThatNeverPublishedLeaveNothingBehind) {
  Daemon daemon(single_model());
  Node node("test");
  auto in = node.input_port<Number>("/in");
  for (int i = 0; i < 600; ++i) {
    auto out = node.output_port<Number>("/out");
    EXPECT_FALSE(in.take());
  }
  auto out = node.output_port<Number>("/out");
  EXPECT_EQ(out.publish(Number{7}).delivered, 1u);
  EXPECT_EQ(take_all(in), (std::vector<std::int64_t>{7}));
}

TEST(DataPath, AShorterTDoesNotHoldUpWhatIsOverridden) {
  Daemon daemon(override_model("1000s"));
  Node node("test");
  auto low = node.output_port<Number>("/low");
  auto high = node.output_port<Number>("/high");
  auto in = node.input_port<Number>("/in");
  EXPECT_EQ(low.publish(Number{1}).delivered, 1u);
  EXPECT_EQ(high.publish(Number{2}).delivered, 1u);
  daemon.load(override_model("1s"));
  EXPECT_EQ(take_all(in), (std::vector<std::int64_t>{2}));
}

// High wins for a while, low is to take over; then something happens that only high can outlast.
// The waiter must hear that its port is idle, and would else wait for ever.
class Takeover {
 public:
  explicit Takeover(const std::string& low_condition, const std::string& stop_timeout = "forever")
      : daemon_(
            "<behaviors timeout=\"forever\"><source port=\"/high\" timeout=\"300ms\"/>"
            "<source port=\"/stop\" timeout=\"" +
            stop_timeout + "\"/>" +
            arbiter_at("/in", select("/low", low_condition) + select("/high")) + "</behaviors>") {}

  void begin() {
    low.signal();
    high.signal();
    while (in_.idle()) high.signal();  // of what it has not seen it is not told
  }
  void expect_idle_after(const std::function<void()>& event) {
    Watched waiter(
        [&] { EXPECT_EQ(in_.wait_for(std::chrono::hours(1)).status(), WaitStatus::idle); });
    waiter.wait_until_asleep();
    event();
    waiter.join();
  }

 private:
  Daemon daemon_;
  Node node_{"test"};
  InputPort<Number> in_ = node_.input_port<Number>("/in");

 public:
  OutputPort<Number> low = node_.output_port<Number>("/low");
  OutputPort<Number> high = node_.output_port<Number>("/high");
  OutputPort<Number> stop = node_.output_port<Number>("/stop");
};

TEST(DataPath, AWaiterHearsOfIdlenessThoughItsNextCommanderLeft) {
  Takeover takeover("not /high");
  takeover.begin();
  takeover.expect_idle_after([&] { takeover.low.deactivate(); });
}

TEST(DataPath, AWaiterHearsOfIdlenessThoughItsNextCommanderWasOverridden) {
  Takeover takeover("not /high and not /stop");
  takeover.begin();
  takeover.expect_idle_after([&] { takeover.stop.signal(); });
}

TEST(DataPath, AWaiterHearsOfIdlenessThoughAnOverrideOfItsNextCommanderWasRenewed) {
  Takeover takeover("not /high and not /stop", "3600s");
  takeover.stop.signal();
  takeover.begin();
  takeover.expect_idle_after([&] { takeover.stop.signal(); });
}

// One thread publishes 1, 2, 3… at two ports in turn: one take must not see the second of two
// without the first.
TEST(DataPath, SamplesOfSeveralSourcesComeInTheOrderOfTheirArrival) {
  Daemon::Options options;
  options.application = application(connection("/a", "/in") + connection("/b", "/in"));
  Daemon daemon(kNoRules, options);
  Node node("test");
  auto a = node.output_port<Number>("/a");
  auto b = node.output_port<Number>("/b");
  auto in = node.input_port<Number>("/in", {.depth = 64, .when_full = refuse_new});
  std::atomic<bool> stop{false};
  std::thread publisher([&] {
    for (std::int64_t i = 0; !stop;) {
      if (a.publish(Number{++i}).delivered == 0) --i;
      if (b.publish(Number{++i}).delivered == 0) --i;
    }
  });
  std::int64_t last = 0;
  std::uint64_t taken = 0, wrong = 0;
  while (taken < 300000) {
    auto sample = in.take();
    if (!sample) continue;
    ++taken;
    if ((**sample).value < last) ++wrong;
    last = (**sample).value;
  }
  stop = true;
  publisher.join();
  EXPECT_EQ(wrong, 0u) << "of " << taken;
}

// Accounts: what was accepted was taken, dropped, overtaken, or waits.
TEST(DataPath, AccountsBalanceWhereLosersAreOvertakenWhileTheyAreDropped) {
  Daemon daemon(override_model());
  Node node("test");
  auto low = node.output_port<Number>("/low");
  auto high = node.output_port<Number>("/high");
  auto in = node.input_port<Number>("/in", {.depth = 1});
  std::atomic<bool> stop{false};
  std::thread lower([&] {
    while (!stop) low.publish(Number{1});
  });
  std::thread higher([&] {
    while (!stop) {
      high.publish(Number{2});
      high.deactivate();
    }
  });
  for (int i = 0; i < 1000000; ++i) static_cast<void>(in.take());
  stop = true;
  lower.join();
  higher.join();
  while (in.take()) {
  }
  for (const char* name : {"/low", "/high"}) {
    const auto c = daemon.connection(name, "/in");
    EXPECT_EQ(c["accepted"].get<long>(), c["taken"].get<long>() + c["dropped"].get<long>() +
                                             c["overtaken"].get<long>() + c["waiting"].get<long>())
        << c;
  }
}

}  // namespace
}  // namespace arbiter::test
