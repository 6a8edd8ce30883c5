// Rule 8 of docs/hosts.md: what a host does that is asked to prepare, to commit and to release, and
// that it keeps its model if it hears no commit for 2 s; beside a daemon that only says what a test
// wants.
#include "link/switching.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <string>
#include <vector>

namespace arbiter::link {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;

class OneHost : public testing::Test {
 protected:
  Question question(Incarnation asker, std::uint64_t attempt,
                    const std::vector<std::string>& without = {}) {
    return {"head", asker, "", wire::write_switch_request({attempt, "dance", without})};
  }

  shm::Nanoseconds now_ = 1;
  std::vector<std::string> asked_;  // of the daemon
  std::string refuses_;             // what the daemon says, if anything
  bool is_slow_ = false;
  Switching switching_{"base",
                       [this](const std::string& model, bool is_dry_run) {
                         asked_.push_back((is_dry_run ? "try " : "switch ") + model);
                         if (is_slow_) throw NoAnswer("it is slow");
                         if (!refuses_.empty()) throw std::runtime_error(refuses_);
                         wire::SwitchAnswer answer;
                         answer.generation = 5;
                         answer.model = model;
                         return answer;
                       },
                       [this] { return now_; }};
};

TEST_F(OneHost, PreparesAndThenSwitches) {
  EXPECT_FALSE(switching_.prepare(question(7, 1)).is_refusal);
  EXPECT_THAT(asked_, ElementsAre("try dance"));
  const Answer done = switching_.commit(question(7, 1));
  ASSERT_FALSE(done.is_refusal) << done.text;
  EXPECT_EQ(wire::read_switch_answer(done.text).generation, 5u);
  EXPECT_THAT(asked_, ElementsAre("try dance", "switch dance"));
  EXPECT_TRUE(switching_.commit(question(7, 1)).is_refusal) << "once";
  EXPECT_EQ(asked_.size(), 2u);
}

TEST_F(OneHost, PromisesNothingThatItsDaemonWouldRefuse) {
  refuses_ = "there is no model";
  EXPECT_THROW(static_cast<void>(switching_.prepare(question(7, 1))), std::runtime_error);
  refuses_.clear();
  EXPECT_TRUE(switching_.commit(question(7, 1)).is_refusal);
  EXPECT_FALSE(switching_.prepare(question(8, 1)).is_refusal) << "nor is it busy";
}

TEST_F(OneHost, ASecondPrepareIsBusyAndAsksNoDaemon) {
  static_cast<void>(switching_.prepare(question(7, 1)));
  const Answer second = switching_.prepare(question(8, 2));
  EXPECT_TRUE(second.is_refusal);
  EXPECT_THAT(second.text, HasSubstr("busy"));
  EXPECT_EQ(asked_.size(), 1u);
  static_cast<void>(switching_.release(question(8, 2)));
  EXPECT_TRUE(switching_.prepare(question(8, 2)).is_refusal) << "it was not theirs to release";
  static_cast<void>(switching_.release(question(7, 1)));
  EXPECT_FALSE(switching_.prepare(question(8, 2)).is_refusal);
}

TEST_F(OneHost, WithoutACommitWithinTwoSecondsItKeepsItsModel) {
  static_cast<void>(switching_.prepare(question(7, 1)));
  now_ += Promise::kHolds;
  EXPECT_TRUE(switching_.commit(question(7, 1)).is_refusal);
  EXPECT_THAT(asked_, ElementsAre("try dance"));
}

TEST_F(OneHost, ACommitOfAnEarlierLifeOrAnotherAttemptIsNone) {
  static_cast<void>(switching_.prepare(question(7, 1)));
  EXPECT_TRUE(switching_.commit(question(6, 1)).is_refusal);
  EXPECT_TRUE(switching_.commit(question(7, 2)).is_refusal);
  EXPECT_THAT(asked_, ElementsAre("try dance"));
  EXPECT_FALSE(switching_.commit(question(7, 1)).is_refusal);
}

// What was prepared counts, and not what a commit says.
TEST_F(OneHost, ACommitCannotNameAnotherModel) {
  static_cast<void>(switching_.prepare(question(7, 1)));
  static_cast<void>(
      switching_.commit({"head", 7, "", wire::write_switch_request({1, "rest", {}})}));
  EXPECT_THAT(asked_, ElementsAre("try dance", "switch dance"));
}

TEST_F(OneHost, WhatADaemonDoesNotAnswerIsUnknownAndNoRefusal) {
  static_cast<void>(switching_.prepare(question(7, 1)));
  is_slow_ = true;
  const Answer done = switching_.commit(question(7, 1));
  ASSERT_FALSE(done.is_refusal);
  EXPECT_EQ(wire::read_switch_answer(done.text).unknown, "it is slow");
}

TEST_F(OneHost, ThatIsLeftOutPromisesNothing) {
  const Answer answer = switching_.prepare(question(7, 1, {"head", "base"}));
  EXPECT_TRUE(wire::read_switch_answer(answer.text).is_left_out);
  EXPECT_TRUE(
      wire::read_switch_answer(switching_.commit(question(7, 1, {"base"})).text).is_left_out);
  EXPECT_THAT(asked_, IsEmpty());
  EXPECT_FALSE(switching_.prepare(question(8, 1)).is_refusal) << "it is not busy";
}

TEST_F(OneHost, RefusesWhatItCannotRead) {
  EXPECT_THROW(static_cast<void>(switching_.prepare({"head", 7, "", "nonsense"})),
               std::runtime_error);
  EXPECT_THROW(static_cast<void>(switching_.commit({"head", 7, "", ""})), std::runtime_error);
  EXPECT_THAT(asked_, IsEmpty());
}

}  // namespace
}  // namespace arbiter::link
