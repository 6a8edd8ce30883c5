// Whose word the gateway takes for it that the daemon does not know its node.
#include "gateway/core/turned_away.hpp"

#include <gtest/gtest.h>
#include <unistd.h>

#include <string>
#include <vector>

namespace arbiter::gateway {
namespace {

constexpr shm::Nanoseconds kASecond = 1'000'000'000;

wire::StrangerStatus stranger(const std::string& node, int pid, shm::Nanoseconds since,
                              shm::Nanoseconds seen) {
  wire::StrangerStatus result;
  result.node = node;
  result.pid = pid;
  result.since = since;
  result.seen = seen;
  return result;
}

std::optional<shm::Nanoseconds> at(std::vector<wire::StrangerStatus> strangers) {
  wire::Status status;
  status.strangers = std::move(strangers);
  return turned_away_at(status, "gateway");
}

TEST(TurnedAway, IsWhoAsksAgainForSomeTimeInVain) {
  EXPECT_EQ(at({stranger("gateway", ::getpid(), 10 * kASecond, 12 * kASecond)}), 12 * kASecond);
}

TEST(TurnedAway, IsNobodyWhoseOwnDaemonMayStillCome) {
  EXPECT_FALSE(at({stranger("gateway", ::getpid(), 10 * kASecond, 12 * kASecond - 1)}));
  EXPECT_FALSE(at({}));
}

TEST(TurnedAway, IsNotWhoSharesTheNameOrTheProcess) {
  EXPECT_FALSE(at({stranger("gateway", ::getppid(), 0, 12 * kASecond)}));
  EXPECT_FALSE(at({stranger("other", ::getpid(), 0, 12 * kASecond)}));
}

TEST(TurnedAway, TheLastTimeCounts) {
  EXPECT_EQ(at({stranger("gateway", ::getpid(), 0, 12 * kASecond),
                stranger("gateway", ::getpid(), 0, 30 * kASecond),
                stranger("gateway", ::getpid(), 0, 20 * kASecond)}),
            30 * kASecond);
}

}  // namespace
}  // namespace arbiter::gateway
