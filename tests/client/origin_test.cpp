// Samples that a component passes on say where they began.
#include <gtest/gtest.h>

#include <array>
#include <cstdint>
#include <utility>

#include <arbiter/arbiter.hpp>

#include "tests/client/models.hpp"
#include "tests/client/samples.hpp"
#include "tests/client/tapping.hpp"
#include "tests/support/daemon.hpp"

namespace arbiter::test {
namespace {

constexpr Origin kOrigin{0xfedc'ba98'7654'3210, 8841};

void expect_origin(const Origin& origin, const Origin& expected) {
  EXPECT_EQ(origin.publisher, expected.publisher);
  EXPECT_EQ(origin.sequence, expected.sequence);
}

TEST(Origins, AreToldToTheReceiver) {
  Daemon daemon(single_model());
  Node node("test");
  auto out = node.output_port<Number>("/out");
  auto in = node.input_port<Number>("/in");
  EXPECT_EQ(out.publish(std::move(*out.loan()), Time::max(), kOrigin).delivered, 1U);
  const auto sample = in.take();
  ASSERT_TRUE(sample);
  expect_origin(sample->origin(), kOrigin);
  EXPECT_EQ(sample->sequence(), 1U) << "that is another count";
}

// A slot is used again, by samples that have no origin.
TEST(Origins, AreThoseOfOneSampleOnly) {
  Daemon daemon(single_model());
  Node node("test");
  auto out = node.output_port<Number>("/out");
  auto in = node.input_port<Number>("/in");
  for (int i = 0; i < 64; ++i) {
    out.publish(std::move(*out.loan()), Time::max(), kOrigin);
    EXPECT_EQ(in.take()->origin().publisher, kOrigin.publisher);
  }
  for (int i = 0; i < 64; ++i) {
    out.publish(Number{i});
    EXPECT_EQ(in.take()->origin().publisher, 0U);
  }
}

// One that was late has used no sequence; the next one has that, and perhaps its slot.
TEST(Origins, OfASampleThatWasLateGoToNoOther) {
  Daemon daemon(single_model());
  Node node("test");
  auto out = node.output_port<Number>("/out", {.max_loans = 1});
  auto in = node.input_port<Number>("/in");
  EXPECT_TRUE(out.publish(std::move(*out.loan()), Time{}, kOrigin).late);
  EXPECT_TRUE(out.signal(Time{}, kOrigin).late);
  out.publish(std::move(*out.loan()));
  EXPECT_EQ(in.take()->origin().publisher, 0U);
}

TEST(Origins, HoldForBytesToo) {
  Daemon daemon(single_model());
  Node node("test");
  auto out = node.output_port("/out", {.max_size = 8});
  auto in = node.input_port("/in");
  EXPECT_EQ(out.publish(std::move(*out.loan(4)), Time::max(), kOrigin).delivered, 1U);
  expect_origin(in.take()->origin(), kOrigin);
}

TEST(Origins, AreToldToATap) {
  Daemon daemon(single_model());
  Node node("test");
  auto out = node.output_port<Number>("/out");
  Node other("watcher");
  auto tap = other.tap("/out");
  wait_until_watched(out, tap);
  out.publish(std::move(*out.loan()), Time::max(), kOrigin);
  out.signal(Time::max(), {kOrigin.publisher, kOrigin.sequence + 1});
  out.publish(Number{3});
  out.publish(std::move(*out.loan()), Time::max(), kOrigin);
  out.deactivate();
  expect_origin(next_of(tap)->origin(), kOrigin);
  expect_origin(next_of(tap)->origin(), {kOrigin.publisher, kOrigin.sequence + 1});
  expect_origin(next_of(tap)->origin(), {});
  expect_origin(next_of(tap)->origin(), kOrigin);
  expect_origin(next_of(tap)->origin(), {});
}

}  // namespace
}  // namespace arbiter::test
