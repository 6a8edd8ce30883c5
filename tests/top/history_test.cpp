// Stepping back through what was just seen.
#include "top/history.hpp"

#include <gtest/gtest.h>

#include "tests/top/pictures.hpp"

namespace arbiter::top {
namespace {

shm::Nanoseconds second_of(const History& history) { return history.frame()->now / kSecond; }

TEST(TopHistory, ShowsTheLastPicture) {
  History history(10);
  EXPECT_EQ(history.frame(), nullptr);
  history.add(shared(frame_at(1)), {});
  history.add(shared(frame_at(2)), {});
  EXPECT_EQ(second_of(history), 2);
}

TEST(TopHistory, APauseKeepsItsPictureAndAllBefore) {
  History history(3);
  for (int i = 1; i <= 3; ++i) history.add(shared(frame_at(i)), {});
  history.pause();
  for (int i = 4; i <= 9; ++i) history.add(shared(frame_at(i)), {});
  EXPECT_EQ(second_of(history), 3);
  history.step(-2);
  EXPECT_EQ(second_of(history), 1);
  EXPECT_EQ(history.age(), 2 * kSecond);
  history.resume();
  EXPECT_EQ(second_of(history), 9);
  history.step(-2);
  EXPECT_EQ(second_of(history), 7);  // what came during the pause is there
}

TEST(TopHistory, StepsStopAtTheEnds) {
  History history(3);
  for (int i = 1; i <= 5; ++i) history.add(shared(frame_at(i)), {});
  history.step(-100);
  EXPECT_TRUE(history.is_paused());
  EXPECT_EQ(second_of(history), 3);
  history.step(100);
  EXPECT_EQ(second_of(history), 5);
}

TEST(TopHistory, StepsOfNothingShowNothing) {
  History history(3);
  history.step(-1);
  EXPECT_FALSE(history.is_paused());
  EXPECT_EQ(history.frame(), nullptr);
}

TEST(TopHistory, ShowsTheChangesUpToThePicture) {
  History history(10);
  Frame frame = frame_at(1);
  frame.takeovers = 1;
  history.add(shared(frame), {takeover(1, "/face:o")});
  frame = frame_at(2);
  frame.takeovers = 3;
  history.add(shared(frame), {takeover(2, "/object:o"), takeover(3, "/rest:o")});
  ASSERT_EQ(history.takeovers().size(), 3u);
  EXPECT_EQ(history.takeovers()[0]->winner, "/rest:o");
  history.step(-1);
  ASSERT_EQ(history.takeovers().size(), 1u);
  EXPECT_EQ(history.takeovers()[0]->winner, "/face:o");
}

TEST(TopHistory, KeepsFewerPicturesOfALargeInstance) {
  History history(1000);
  Frame frame = frame_at(1);
  frame.words.resize(1'000'000);  // 8 MB
  for (int i = 1; i <= 9; ++i) {
    frame.now = i * kSecond;
    history.add(shared(frame), {});
  }
  history.step(-1000);
  EXPECT_EQ(second_of(history), 6);
}

TEST(TopHistory, CountsAllThatAPictureHasOfEachSource) {
  History history(1000);
  Frame frame = frame_at(1);
  frame.words.resize(1'000'000);
  frame.slow_periods.resize(1'000'000);
  for (int i = 1; i <= 9; ++i) {
    frame.now = i * kSecond;
    history.add(shared(frame), {});
  }
  history.step(-1000);
  EXPECT_EQ(second_of(history), 8);
}

TEST(TopHistory, KeepsSoManyChanges) {
  History history(10, 2);
  Frame frame = frame_at(1);
  frame.takeovers = 3;
  history.add(shared(frame), {takeover(1, "/a"), takeover(2, "/b"), takeover(3, "/c")});
  ASSERT_EQ(history.takeovers().size(), 2u);
  EXPECT_EQ(history.takeovers()[1]->winner, "/b");
}

}  // namespace
}  // namespace arbiter::top
