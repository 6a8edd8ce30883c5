// What is left to threads that may be lost: a user's errands wait for that user's alone.
#include "wire/errands.hpp"

#include <gtest/gtest.h>
#include <unistd.h>

#include <atomic>
#include <future>
#include <vector>

#include "shm/clock.hpp"

namespace arbiter::wire {
namespace {

constexpr uid_t kOne = 1;
constexpr uid_t kOther = 2;
constexpr shm::Nanoseconds kLong = 60'000'000'000;

// Errands that wait until the test lets them go.
class Held {
 public:
  explicit Held(Errands& errands) : errands_(errands) {}
  // Begins one, and returns once its thread is in it.
  void keep_a_thread(uid_t user) {
    auto begun = std::make_shared<std::promise<void>>();
    auto has_begun = begun->get_future();
    errands_.run(user, [begun, end = end_] {
      begun->set_value();
      end.wait();
    });
    has_begun.wait();
  }
  void let_go() { promise_.set_value(); }

 private:
  Errands& errands_;
  std::promise<void> promise_;
  std::shared_future<void> end_ = promise_.get_future().share();
};

std::future<void> run(Errands& errands, uid_t user) {
  auto done = std::make_shared<std::promise<void>>();
  auto result = done->get_future();
  errands.run(user, [done] { done->set_value(); });
  return result;
}

bool is_done(const std::future<void>& errand) {
  return errand.wait_for(std::chrono::seconds(0)) == std::future_status::ready;
}

TEST(Errands, OfAUserAreDoneInTheirOrder) {
  Errands errands;
  std::vector<int> order;
  for (int i = 0; i < 100; ++i) {
    errands.run(kOne, [&order, i] { order.push_back(i); });
  }
  ASSERT_TRUE(errands.wait_until_done(kLong));
  ASSERT_EQ(order.size(), 100u);
  EXPECT_TRUE(std::is_sorted(order.begin(), order.end()));
  EXPECT_EQ(errands.deadline(), shm::kForever);
}

TEST(Errands, ThatWaitHoldUpNoOtherUsers) {
  Errands errands;
  Held held(errands);
  held.keep_a_thread(kOne);
  const auto own = run(errands, kOne);
  run(errands, kOther).wait();
  EXPECT_FALSE(is_done(own));
  held.let_go();
  own.wait();
  EXPECT_TRUE(errands.wait_until_done(kLong));
}

TEST(Errands, AreTakenUpByAnotherThreadWhenTheirsIsLost) {
  Errands errands;
  Held held(errands);
  held.keep_a_thread(kOne);
  const auto next = run(errands, kOne);
  const shm::Nanoseconds begin = shm::monotonic_now();
  EXPECT_EQ(errands.look_after(begin), "");
  EXPECT_LE(errands.deadline(), begin + Errands::kOverdue);
  const std::string said = errands.look_after(begin + Errands::kOverdue);
  EXPECT_NE(said.find("user 1 keeps a thread waiting"), std::string::npos) << said;
  next.wait();
  EXPECT_EQ(errands.lost(), 1u);
  EXPECT_EQ(errands.look_after(begin + Errands::kOverdue), "") << "it was said";
  held.let_go();
  EXPECT_TRUE(errands.wait_until_done(kLong));
  EXPECT_EQ(errands.lost(), 0u);
}

TEST(Errands, OfOneUserLoseABoundedNumberOfThreads) {
  Errands errands;
  Held held(errands);
  for (std::size_t i = 0; i < Errands::kMaxLostOfAUser; ++i) {
    held.keep_a_thread(kOne);
    EXPECT_NE(errands.look_after(shm::monotonic_now() + Errands::kOverdue), "");
  }
  const auto waiting = run(errands, kOne);
  EXPECT_EQ(errands.lost(), Errands::kMaxLostOfAUser);
  EXPECT_EQ(errands.deadline(), shm::kForever);
  run(errands, kOther).wait();
  EXPECT_FALSE(is_done(waiting));
  held.let_go();
  waiting.wait();
  EXPECT_TRUE(errands.wait_until_done(kLong));
}

TEST(Errands, OfWhichTooManyWaitMakeTheirUserStuck) {
  Errands errands;
  Held held(errands);
  const auto wait = [&](std::size_t count) {
    for (std::size_t i = 0; i < count; ++i) errands.run(kOne, [] {});
  };
  held.keep_a_thread(kOne);
  wait(Errands::kMostWaiting - 1);
  EXPECT_FALSE(errands.is_stuck(kOne)) << "its thread may come back";
  wait(1);
  EXPECT_TRUE(errands.is_stuck(kOne)) << "though it is not lost";
  EXPECT_FALSE(errands.is_stuck(kOther));
  held.let_go();
  EXPECT_TRUE(errands.wait_until_done(kLong));
  EXPECT_FALSE(errands.is_stuck(kOne));
}

TEST(Errands, OfAUserWithoutAThreadMakeItStuckSooner) {
  Errands errands;
  Held held(errands);
  for (std::size_t i = 0; i < Errands::kMaxLostOfAUser; ++i) {
    held.keep_a_thread(kOne);
    EXPECT_NE(errands.look_after(shm::monotonic_now() + Errands::kOverdue), "");
  }
  for (std::size_t i = 1; i < Errands::kMaxWaiting; ++i) errands.run(kOne, [] {});
  EXPECT_FALSE(errands.is_stuck(kOne));
  errands.run(kOne, [] {});
  EXPECT_TRUE(errands.is_stuck(kOne));
  held.let_go();
  EXPECT_TRUE(errands.wait_until_done(kLong));
  EXPECT_FALSE(errands.is_stuck(kOne));
}

TEST(Errands, OutliveWhoGaveThem) {
  auto errands = std::make_unique<Errands>();
  Held held(*errands);
  held.keep_a_thread(kOne);
  const auto next = run(*errands, kOne);
  errands.reset();
  held.let_go();
  next.wait();
}

TEST(Errands, CloseWhatTheyAreGiven) {
  Errands errands;
  int ends[2];
  ASSERT_EQ(::pipe(ends), 0);
  const shm::FileDescriptor read_end(ends[0]);
  errands.close(kOne, shm::FileDescriptor(ends[1]));
  char byte = 0;
  EXPECT_EQ(::read(read_end.get(), &byte, 1), 0);
}

}  // namespace
}  // namespace arbiter::wire
