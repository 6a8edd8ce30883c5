// Samples and loans: memory that is held is not used again, and everything may go in any order.
#include <gtest/gtest.h>

#include <optional>
#include <stdexcept>
#include <utility>

#include <arbiter/arbiter.hpp>

#include "tests/client/component.hpp"
#include "tests/client/models.hpp"
#include "tests/client/samples.hpp"
#include "tests/support/daemon.hpp"

namespace arbiter::test {
namespace {

// The service thread has tidied up once it has answered.
void let_it_tidy_up(Node& node) {
  for (int i = 0; i < 3; ++i) static_cast<void>(node.input_port("/elsewhere"));
}

TEST(Holding, AHeldSamplesMemoryIsNotUsedAgainHoweverMuchIsPublished) {
  Daemon daemon(single_model());
  Node node("test");
  auto out = node.output_port<Number>("/out");
  auto in = node.input_port<Number>("/in", {.depth = 2, .max_held = 2});
  out.publish(Number{-1});
  const auto held = in.take();
  ASSERT_TRUE(held);
  for (int i = 0; i < 5000; ++i) {
    ASSERT_EQ(out.publish(Number{i}).delivered, 1u);
    ASSERT_EQ((**held).value, -1);
    EXPECT_TRUE(i % 7 != 0 || in.take());
  }
  EXPECT_EQ(daemon.source("/out")["no_slot"], 0);
}

TEST(Holding, TakingMoreThanMaxHeldThrows) {
  Daemon daemon(single_model());
  Node node("test");
  auto out = node.output_port<Number>("/out");
  auto in = node.input_port<Number>("/in", {.max_held = 2});
  for (int i = 0; i < 3; ++i) out.publish(Number{i});
  auto first = in.take();
  auto second = in.take();
  EXPECT_THROW(static_cast<void>(in.take()), Error);
  EXPECT_THROW(static_cast<void>(in.wait_for(std::chrono::hours(1))), Error);
  EXPECT_EQ((**first).value, 0);
  second.reset();
  EXPECT_EQ(take_from(in), 2) << "the one that was not taken still waits";
}

TEST(Holding, SamplesMoveAndAreGivenBackOnce) {
  Daemon daemon(single_model());
  Node node("test");
  auto out = node.output_port<Number>("/out");
  auto in = node.input_port<Number>("/in", {.max_held = 2});
  out.publish(Number{1});
  out.publish(Number{2});
  auto first = std::move(*in.take());
  auto second = std::move(*in.take());
  first = std::move(second);
  EXPECT_EQ(first->value, 2);
  auto& self = first;
  first = std::move(self);
  EXPECT_EQ(first->value, 2);
  out.publish(Number{3});
  EXPECT_EQ(take_from(in), 3) << "one of two is held";
}

TEST(Holding, ASampleOutlivesItsPort) {
  Daemon daemon(single_model());
  Node node("test");
  auto out = node.output_port<Number>("/out");
  std::optional<Sample<Number>> sample;
  {
    auto in = node.input_port<Number>("/in");
    out.publish(Number{-1});
    sample = in.take();
  }
  for (int i = 0; i < 1000; ++i) out.publish(Number{i});
  EXPECT_EQ((**sample).value, -1);
  EXPECT_EQ(sample->source(), "/out");
  sample.reset();
  auto again = node.input_port<Number>("/in");
  EXPECT_EQ(out.publish(Number{5}).delivered, 1u);
}

TEST(Holding, ASampleOutlivesItsNode) {
  Daemon daemon(single_model());
  std::optional<Sample<Number>> sample;
  {
    Node node("test");
    auto out = node.output_port<Number>("/out");
    auto in = node.input_port<Number>("/in");
    out.publish(Number{-1});
    sample = in.take();
  }
  EXPECT_EQ((**sample).value, -1);
  EXPECT_EQ(sample->source(), "/out");
}

TEST(Holding, ASampleOutlivesItsPublishersPort) {
  Daemon daemon(single_model());
  Node node("test");
  auto in = node.input_port<Number>("/in");
  std::optional<Sample<Number>> sample;
  {
    auto out = node.output_port<Number>("/out");
    out.publish(Number{-1});
    sample = in.take();
  }
  EXPECT_FALSE(in.take()) << "what the publisher left is used up";
  auto successor = node.output_port<Number>("/out");
  EXPECT_FALSE(in.take());
  let_it_tidy_up(node);
  EXPECT_FALSE(in.take());
  let_it_tidy_up(node);
  EXPECT_EQ((**sample).value, -1);
  EXPECT_EQ(sample->source(), "/out");
}

TEST(Holding, ASampleOutlivesItsPublishersProcess) {
  Daemon daemon(single_model());
  Node node("test");
  auto in = node.input_port<Number>("/in", {.max_held = 2});
  std::vector<Sample<Number>> samples;
  for (int i = 0; i < 2; ++i) {
    Component sender("sender");
    ASSERT_EQ(sender.tell("output /out"), "open");
    hear_all(node);
    EXPECT_EQ(sender.tell("publish /out " + std::to_string(i)), "1 0 0");
    samples.push_back(std::move(*in.take()));
    sender.kill();
  }
  auto successor = node.output_port<Number>("/out");
  EXPECT_FALSE(in.take());
  let_it_tidy_up(node);
  EXPECT_FALSE(in.take());
  let_it_tidy_up(node);
  EXPECT_EQ(samples[0]->value, 0);
  EXPECT_EQ(samples[1]->value, 1);
  samples.pop_back();
  successor.publish(Number{7});
  EXPECT_EQ(take_from(in), 7);
  EXPECT_EQ(samples[0]->value, 0);
}

TEST(Holding, ALoanThatIsGivenUpIsFreeAgain) {
  Daemon daemon(single_model());
  Node node("test");
  auto out = node.output_port<Number>("/out", {.max_loans = 1});
  auto in = node.input_port<Number>("/in");
  for (int i = 0; i < 1000; ++i) {
    auto loan = out.loan();
    ASSERT_TRUE(loan);
    (*loan)->value = i;
  }
  EXPECT_FALSE(in.take()) << "nothing was published";
}

TEST(Holding, MoreLoansThanAllowedAreEmpty) {
  Daemon daemon(single_model());
  Node node("test");
  auto out = node.output_port<Number>("/out", {.max_loans = 2});
  auto in = node.input_port<Number>("/in");
  auto first = out.loan();
  auto second = out.loan();
  EXPECT_TRUE(first);
  EXPECT_TRUE(second);
  EXPECT_FALSE(out.loan());
  EXPECT_EQ(out.publish(Number{1}).delivered, 1u) << "a copy needs no loan";
  (*first)->value = 2;
  EXPECT_EQ(out.publish(std::move(*first)).delivered, 1u);
  EXPECT_TRUE(out.loan());
  EXPECT_EQ(take_from(in), 1);
  EXPECT_EQ(take_from(in), 2);
}

TEST(Holding, ALoanOutlivesItsPortButCannotBePublishedThere) {
  Daemon daemon(single_model());
  Node node("test");
  std::optional<Loan<Number>> loan;
  {
    auto out = node.output_port<Number>("/out");
    loan = out.loan();
  }
  (*loan)->value = 5;
  auto successor = node.output_port<Number>("/out");
  EXPECT_THROW(successor.publish(std::move(*loan)), std::invalid_argument);
}

TEST(Holding, ALoanThatWasMovedFromCannotBePublished) {
  Daemon daemon(single_model());
  Node node("test");
  auto out = node.output_port<Number>("/out");
  auto loan = out.loan();
  auto other = std::move(*loan);
  EXPECT_THROW(out.publish(std::move(*loan)), std::invalid_argument);  // NOLINT: that is the test
  auto& itself = other;
  other = std::move(itself);
  EXPECT_EQ(out.publish(std::move(other)).delivered, 0u);
}

TEST(Holding, PortsMove) {
  Daemon daemon(single_model());
  Node node("test");
  auto out = node.output_port<Number>("/out");
  auto in = node.input_port<Number>("/in");
  auto moved_out = std::move(out);
  auto moved_in = std::move(in);
  EXPECT_EQ(moved_out.publish(Number{1}).delivered, 1u);
  EXPECT_EQ(take_from(moved_in), 1);
  out = std::move(moved_out);
  in = std::move(moved_in);
  EXPECT_EQ(out.publish(Number{2}).delivered, 1u);
  EXPECT_EQ(take_from(in), 2);
}

TEST(Holding, AssigningAPortClosesTheOneThatItWas) {
  Daemon daemon(fan_out_model(2));
  Node node("test");
  auto in = node.input_port<Number>("/in0");
  in = node.input_port<Number>("/in1");
  EXPECT_EQ(in.name(), "/in1");
  auto again = node.input_port<Number>("/in0");
  EXPECT_EQ(again.name(), "/in0");
}

TEST(Holding, PortsOutliveTheirNode) {
  Daemon daemon(single_model());
  auto out = Node("a").output_port<Number>("/out");
  auto in = Node("b").input_port<Number>("/in");
  EXPECT_EQ(out.publish(Number{1}).delivered, 1u);
  EXPECT_EQ(take_from(in), 1);
}

TEST(Holding, UntypedSamplesHaveTheirSize) {
  Daemon daemon(single_model());
  Node node("test");
  auto out = node.output_port("/out", {.max_size = 100});
  auto in = node.input_port("/in", {.depth = 200});
  for (std::size_t size = 0; size <= 100; ++size) {
    auto loan = out.loan(size);
    ASSERT_TRUE(loan);
    for (std::byte& each : **loan) each = static_cast<std::byte>(size);
    EXPECT_EQ(out.publish(std::move(*loan)).delivered, 1u);
  }
  for (std::size_t size = 0; size <= 100; ++size) {
    auto sample = in.take();
    ASSERT_TRUE(sample);
    EXPECT_EQ((**sample).size(), size);
    for (const std::byte each : **sample) EXPECT_EQ(each, static_cast<std::byte>(size));
  }
}

TEST(Holding, UntypedSamplesHaveALimitAndCanShrink) {
  Daemon daemon(single_model());
  Node node("test");
  auto out = node.output_port("/out", {.max_size = 100});
  auto in = node.input_port("/in");
  EXPECT_EQ(out.max_size(), 100u);
  EXPECT_FALSE(out.loan(101));
  const std::array<std::byte, 101> much{};
  EXPECT_THROW(out.publish(Bytes(much.data(), much.size())), std::invalid_argument);
  auto loan = out.loan(100);
  loan->shrink(10);
  out.publish(std::move(*loan));
  EXPECT_EQ(in.take()->size(), 10u);
  out.publish(Bytes(much.data(), 7));
  EXPECT_EQ(in.take()->size(), 7u);
}

TEST(Holding, ATypeWithAStrictAlignmentIsAligned) {
  struct alignas(4096) Page {
    std::array<char, 4096> bytes;
  };
  Daemon daemon(single_model());
  Node node("test");
  auto out = node.output_port<Page>("/out");
  auto in = node.input_port<Page>("/in");
  for (int i = 0; i < 10; ++i) {
    auto loan = out.loan();
    EXPECT_EQ(reinterpret_cast<std::uintptr_t>(loan->get()) % 4096, 0u);
    out.publish(std::move(*loan));
    auto sample = in.take();
    EXPECT_EQ(reinterpret_cast<std::uintptr_t>(sample->get()) % 4096, 0u);
  }
}

}  // namespace
}  // namespace arbiter::test
