// publish() and signal() with a deadline: in time, or no arrival at all.
#include <gtest/gtest.h>

#include <array>
#include <string>
#include <utility>

#include <arbiter/arbiter.hpp>

#include "tests/client/models.hpp"
#include "tests/client/samples.hpp"
#include "tests/support/daemon.hpp"

namespace arbiter::test {
namespace {

constexpr Time kPassed{};
constexpr Time kNever = Time::max();

void expect_late(const Outcome& outcome) {
  EXPECT_TRUE(outcome.late);
  EXPECT_EQ(outcome.delivered + outcome.discarded + outcome.refused, 0u);
}

TEST(Deadline, InTimeAllIsAsWithoutOne) {
  Daemon daemon(single_model());
  Node node("test");
  auto out = node.output_port<Number>("/out");
  auto in = node.input_port<Number>("/in");
  const Outcome copied = out.publish(Number{1}, kNever);
  EXPECT_EQ(copied.delivered, 1u);
  EXPECT_FALSE(copied.late);
  EXPECT_EQ(
      out.publish(std::move(*out.loan()), std::chrono::steady_clock::now() + std::chrono::hours(1))
          .delivered,
      1u);
  EXPECT_FALSE(out.signal(kNever).late);
  EXPECT_EQ(take_all(in).size(), 2u);
  EXPECT_EQ(daemon.source("/out")["late"], 0);
  EXPECT_EQ(daemon.source("/out")["published"], 2);
}

TEST(Deadline, PastItThereIsNoArrival) {
  Daemon daemon(override_model());
  Node node("test");
  auto low = node.output_port<Number>("/low");
  auto high = node.output_port<Number>("/high");
  auto in = node.input_port<Number>("/in");
  expect_late(high.publish(Number{1}, kPassed));
  expect_late(high.publish(std::move(*high.loan()), kPassed));
  expect_late(high.signal(kPassed));
  EXPECT_FALSE(in.take());
  EXPECT_TRUE(in.idle());
  EXPECT_EQ(low.publish(Number{2}).delivered, 1u) << "nobody overrides it";
  const auto source = daemon.source("/high");
  EXPECT_FALSE(source["active"]);
  EXPECT_EQ(source["late"], 3);
  for (const char* counter : {"published", "signals", "delivered", "discarded", "refused"}) {
    EXPECT_EQ(source[counter], 0) << counter;
  }
  EXPECT_EQ(take_from(in), 2);
  high.publish(Number{3});
  const auto sample = in.take();
  ASSERT_TRUE(sample);
  EXPECT_EQ(sample->sequence(), 1u) << "no number was used up";
}

TEST(Deadline, PastItALoanIsFreeAgain) {
  Daemon daemon(single_model());
  Node node("test");
  auto out = node.output_port<Number>("/out", {.max_loans = 1});
  for (int i = 0; i < 3; ++i) {
    auto loan = out.loan();
    ASSERT_TRUE(loan);
    expect_late(out.publish(std::move(*loan), kPassed));
  }
}

TEST(Deadline, HoldsForBytesToo) {
  Daemon daemon(single_model());
  Node node("test");
  auto out = node.output_port("/out", {.max_size = 8});
  auto in = node.input_port("/in");
  const std::array<std::byte, 4> bytes{};
  expect_late(out.publish(Bytes(bytes.data(), bytes.size()), kPassed));
  expect_late(out.publish(std::move(*out.loan(8)), kPassed));
  EXPECT_EQ(out.publish(Bytes(bytes.data(), bytes.size()), kNever).delivered, 1u);
  EXPECT_EQ(out.publish(std::move(*out.loan(8)), kNever).delivered, 1u);
  EXPECT_EQ(in.take()->size(), 4u);
  EXPECT_EQ(in.take()->size(), 8u);
}

TEST(Deadline, TheStatusShowsThoseThatCameLate) {
  Daemon daemon(single_model());
  Node node("test");
  auto out = node.output_port<Number>("/out");
  out.signal(kPassed);
  EXPECT_EQ(daemon.source("/out")["late"], 1);
}

}  // namespace
}  // namespace arbiter::test
