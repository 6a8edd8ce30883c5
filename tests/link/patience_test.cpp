// How long one look may wait for a daemon.
#include "link/core/patience.hpp"

#include <gtest/gtest.h>

namespace arbiter::link {
namespace {

// A hundred ports are to be opened, and the daemon is stopped: each call waits for a second.
TEST(Patience, AfterOneCallThatIsNotAnsweredTheLoopGoesRound) {
  shm::Nanoseconds now = 5;
  int rounds = 0;
  const Patience patience([&] { return now; }, [&] { ++rounds; });
  int calls = 0;
  for (int i = 0; i < 100 && patience.is_left(); ++i, ++calls) {
    now += 1'000'000'000;
    patience.note_call();
  }
  EXPECT_EQ(calls, 1);
  EXPECT_EQ(rounds, 1) << "somebody sees that it goes on";
  EXPECT_FALSE(patience.is_left()) << "nor does the next one wait that has the same patience";
}

TEST(Patience, CallsThatAreAnsweredAreMadeInOneLook) {
  shm::Nanoseconds now = 5;
  const Patience patience([&] { return now; }, [] {});
  for (int i = 0; i < 100; ++i, now += 1'000'000) EXPECT_TRUE(patience.is_left());
}

}  // namespace
}  // namespace arbiter::link
