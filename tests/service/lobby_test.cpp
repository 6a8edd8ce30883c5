#include "service/clients/lobby.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <vector>

namespace arbiter::service {
namespace {

using testing::ElementsAre;
using testing::UnorderedElementsAre;

std::vector<uid_t> users(const std::vector<Lobby::Waiting>& waiting) {
  std::vector<uid_t> result;
  for (const Lobby::Waiting& each : waiting) result.push_back(each.user);
  return result;
}

TEST(Lobby, LetsInOneOfEachUserAtATimeHoweverManyOfOneWait) {
  Lobby lobby;
  for (int i = 0; i < 100; ++i) lobby.add({7, {}, {}});
  lobby.add({8, {}, {}});
  EXPECT_THAT(users(lobby.next()), UnorderedElementsAre(7, 8));
  EXPECT_THAT(users(lobby.next()), ElementsAre(7));
  lobby.add({9, {}, {}});
  EXPECT_THAT(users(lobby.next()), UnorderedElementsAre(7, 9));
  EXPECT_FALSE(lobby.empty());
}

TEST(Lobby, GivesBackWhatItCostToWait) {
  Totals totals{};
  totals.fill(100);
  Shares shares(totals, 50, 0);
  Lobby lobby;
  lobby.add({7, {}, shares.take(7, Share::kDescriptors)});
  EXPECT_EQ(shares.taken(7, Share::kDescriptors), 1u);
  lobby.next().clear();
  EXPECT_EQ(shares.taken(7, Share::kDescriptors), 0u);
  EXPECT_TRUE(lobby.empty());
}

}  // namespace
}  // namespace arbiter::service
