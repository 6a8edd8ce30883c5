// Losers wake nobody: whether a receiver that waits is scheduled is read from the kernel's own
// count.
#include <gtest/gtest.h>

#include <arbiter/arbiter.hpp>

#include "tests/client/component.hpp"
#include "tests/client/models.hpp"
#include "tests/client/samples.hpp"
#include "tests/support/daemon.hpp"
#include "tests/support/threads.hpp"

namespace arbiter::test {
namespace {

constexpr int kArrivals = 10000;

// A receiver in a process of its own that waits. Its main thread is the port's.
class Receiver {
 public:
  explicit Receiver(Component& component) : pid_(component.process().pid()) {
    component.begin("wait /in");
    wait_until_it_polls(pid_, pid_);
    before_ = sleeps_of(pid_, pid_);
  }
  [[nodiscard]] std::uint64_t woken() const { return sleeps_of(pid_, pid_) - before_; }

 private:
  pid_t pid_;
  std::uint64_t before_ = 0;
};

TEST(Losers, DoNotWakeAReceiverWhileAnotherCommands) {
  Daemon daemon(override_model());
  Node node("test");
  auto low = node.output_port<Number>("/low");
  auto high = node.output_port<Number>("/high");
  Component arm("arm");
  ASSERT_EQ(arm.tell("input /in 8 1 0"), "open");
  hear_all(node);
  high.signal();
  const Receiver receiver(arm);
  for (int i = 0; i < kArrivals; ++i) {
    EXPECT_EQ(low.publish(Number{i}).discarded, 1u);
    if (i % 100 == 0) low.deactivate();  // begins anew, and is no less a loser
    if (i % 10 == 0) high.signal();
  }
  EXPECT_EQ(receiver.woken(), 0u);
  high.publish(Number{-5});
  EXPECT_EQ(arm.answer(), "-5");
}

TEST(Losers, WakeItOnceWhereAnOverrideThatOnlySaysStopMakesItsPortIdle) {
  Daemon daemon(override_model());
  Node node("test");
  auto low = node.output_port<Number>("/low");
  auto stop = node.output_port<Number>("/stop");
  Component arm("arm");
  ASSERT_EQ(arm.tell("input /in 8 1 0"), "open");
  hear_all(node);
  low.publish(Number{1});
  EXPECT_EQ(arm.tell("wait /in"), "1");
  const Receiver commanded(arm);
  stop.signal();
  EXPECT_EQ(arm.answer(), "idle");
  const Receiver idle(arm);
  for (int i = 0; i < kArrivals; ++i) {
    stop.publish(Number{i});
    low.publish(Number{i});
    if (i % 100 == 0) {  // both begin anew, and the port stays idle
      low.deactivate();
      low.signal();
    }
  }
  EXPECT_EQ(idle.woken(), 0u);
  EXPECT_EQ(daemon.input("/in")["idles"], 1);
  stop.deactivate();
  low.publish(Number{9});
  EXPECT_EQ(arm.answer(), "9");
}

TEST(Losers, AreNotSeenByAReceiverThatPolls) {
  Daemon daemon(override_model());
  Node node("test");
  auto low = node.output_port<Number>("/low");
  auto high = node.output_port<Number>("/high");
  auto in = node.input_port<Number>("/in");
  high.signal();
  pollfd readable{in.fd(), POLLIN, 0};
  EXPECT_FALSE(in.take());
  for (int i = 0; i < kArrivals; ++i) low.publish(Number{i});
  EXPECT_EQ(::poll(&readable, 1, 0), 0);
}

// The receiver's memory is not touched either: what it maps writable nobody else can write, and the
// one thing that others can do to it, ringing its bell, was not done.
TEST(Losers, WriteNothingThatTheReceiverReads) {
  Daemon daemon(override_model());
  Node node("test");
  auto low = node.output_port<Number>("/low");
  auto high = node.output_port<Number>("/high");
  auto in = node.input_port<Number>("/in");
  high.signal();
  EXPECT_FALSE(in.take());
  for (int i = 0; i < kArrivals; ++i) low.publish(Number{i});
  EXPECT_FALSE(in.take());
  const auto connection = daemon.connection("/low", "/in");
  EXPECT_EQ(connection["discarded"], kArrivals);
  EXPECT_EQ(connection["accepted"], 0);
  EXPECT_EQ(connection["dropped"], 0) << "no loser has come as far as the take";
}

}  // namespace
}  // namespace arbiter::test
