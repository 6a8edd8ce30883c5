// Accounts that must balance are asserted, in releases too (shm/assertion.hpp). Each kind fails
// here, by calls that the public API never makes. A child dies of them, on its own copies.
#include <gtest/gtest.h>

#include <vector>

#include <arbiter/arbiter.hpp>

#include "client/input/input_core.hpp"
#include "client/input/lanes.hpp"
#include "client/output/output_core.hpp"
#include "tests/client/models.hpp"
#include "tests/support/daemon.hpp"

namespace arbiter::test {
namespace {

// Ports as the templates of the public API have them.
class AccountsDeathTest : public testing::Test {
 protected:
  ~AccountsDeathTest() override {
    detail::close_output(out_);
    detail::close_input(in_);
    out_.reset();
    in_.reset();
    detail::drop_node(std::move(node_));
  }

  Daemon daemon_{single_model()};
  std::shared_ptr<detail::NodeCore> node_ = detail::make_node("test", {});
  std::shared_ptr<detail::OutputCore> out_ =
      detail::open_output(*node_, "/out", Type::untyped(8), {});
  std::shared_ptr<detail::InputCore> in_ = detail::open_input(*node_, "/in", Type::untyped(8), {});
};

TEST_F(AccountsDeathTest, ALoanEndsOnce) {
  const detail::LoanedSlot loan = out_->loan(8);
  ASSERT_NE(loan.data, nullptr);
  detail::end_loan(*out_, loan.slot);
  // A child that was forked from it would leave the port alone: this one runs the test again.
  GTEST_FLAG_SET(death_test_style, "threadsafe");
  EXPECT_DEATH(detail::end_loan(*out_, loan.slot), "a mistake in the program: a loan ends twice");
}

TEST_F(AccountsDeathTest, ALoanKeepsItsPort) {
  const detail::LoanedSlot loan = out_->loan(8);
  ASSERT_NE(loan.data, nullptr);
  EXPECT_DEATH(out_->~OutputCore(), "an output port ends while its loans are out");
  out_->end_loan(loan.slot);
}

TEST_F(AccountsDeathTest, ASampleIsGivenBackOnce) {
  ASSERT_EQ(out_->publish_copy("sample", 7, shm::monotonic_now()).delivered, 1u);
  const detail::HeldSample sample = in_->take();
  ASSERT_NE(sample.data, nullptr);
  in_->give_back(sample.hold);
  EXPECT_DEATH(in_->give_back(sample.hold), "a sample is given back twice");
}

TEST_F(AccountsDeathTest, ASampleKeepsItsPort) {
  ASSERT_EQ(out_->publish_copy("sample", 7, shm::monotonic_now()).delivered, 1u);
  const detail::HeldSample sample = in_->take();
  ASSERT_NE(sample.data, nullptr);
  EXPECT_DEATH(in_->~InputCore(), "an input port ends while its samples are held");
  in_->give_back(sample.hold);
}

struct FakePeer {
  shm::PortInstance instance;
};
struct FakeQueue {
  const FakePeer* peer;
  const shm::Lane* lane;
};

TEST(LanesDeathTest, EachQueueHasOneOfItsOwn) {
  const auto segment = std::make_unique<shm::InputSegment>();
  segment->lanes[0].publisher = 5;
  segment->lanes[1].publisher = 6;
  const FakePeer five{5};
  const FakePeer six{6};
  const FakeQueue of_five{&five, &segment->lanes[0]};
  const FakeQueue of_six{&six, &segment->lanes[1]};
  detail::require_lanes_balance(*segment, std::vector{of_five, of_six});
  EXPECT_DEATH(detail::require_lanes_balance(*segment, std::vector{of_five}),
               "more lanes or fewer than queues");
  const FakeQueue in_the_lane_of_five{&six, &segment->lanes[0]};
  EXPECT_DEATH(detail::require_lanes_balance(*segment, std::vector{of_five, in_the_lane_of_five}),
               "a queue has another's lane");
}

}  // namespace
}  // namespace arbiter::test
