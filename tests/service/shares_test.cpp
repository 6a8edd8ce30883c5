// What each user may have, and whose turn it is.
#include "service/policy/shares.hpp"

#include <fcntl.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <vector>

#include "service/clients/client.hpp"
#include "service/clients/turns.hpp"
#include "service/policy/headroom.hpp"
#include "shm/segment.hpp"
#include "wire/errands.hpp"

namespace arbiter::service {
namespace {

using testing::HasSubstr;

constexpr uid_t kDaemonsUser = 100, kOne = 1001, kTwo = 1002, kThree = 1003;

Totals of_each(std::uint64_t total) {
  Totals totals{};
  totals.fill(total);
  return totals;
}

std::uint64_t take_all(Shares& shares, uid_t user, std::vector<Charge>& charges) {
  std::uint64_t taken = 0;
  while (shares.allows(user, Share::kClients, 1)) {
    charges.push_back(shares.take(user, Share::kClients));
    ++taken;
  }
  return taken;
}

TEST(Shares, NobodyHasMoreThanIsLeftForTheOthers) {
  Shares shares(of_each(1600), 50, kDaemonsUser);
  std::vector<Charge> charges;
  EXPECT_EQ(take_all(shares, kOne, charges), 750u);  // a sixteenth is kept
  EXPECT_EQ(take_all(shares, kTwo, charges), 375u);
  EXPECT_EQ(take_all(shares, kThree, charges), 187u);
  EXPECT_EQ(take_all(shares, kDaemonsUser, charges), 144u);
  for (uid_t user = 2000; user < 2006; ++user) EXPECT_GT(take_all(shares, user, charges), 0u);
}

TEST(Shares, SomethingIsKeptForRootAndTheDaemonsUser) {
  Shares shares(of_each(1600), 50, kDaemonsUser);
  std::vector<Charge> charges;
  for (uid_t user = 2000; user < 2100; ++user) take_all(shares, user, charges);
  EXPECT_FALSE(shares.allows(kOne, Share::kClients, 1));
  EXPECT_GE(take_all(shares, 0, charges) + take_all(shares, kDaemonsUser, charges), 100u);
}

// In releases too (shm/assertion.hpp).
TEST(SharesDeathTest, EndInADeathIfSomethingWasNotGivenBack) {
  const auto forget = [] {
    Charge charge;
    Shares shares(of_each(1600), 50, kDaemonsUser);
    charge = shares.take(kOne, Share::kInputs, 700);
  };
  EXPECT_DEATH(forget(),
               "a mistake in the program: a user's share is still taken when the daemon ends");
}

TEST(Shares, AreGivenBackWithTheCharge) {
  Shares shares(of_each(1600), 50, kDaemonsUser);
  {
    Charge charge = shares.take(kOne, Share::kInputs, 700);
    EXPECT_EQ(shares.taken(kOne, Share::kInputs), 700u);
    EXPECT_FALSE(shares.allows(kOne, Share::kInputs, 100));
    Charge moved = std::move(charge);
    EXPECT_EQ(shares.taken(kOne, Share::kInputs), 700u);
    moved = shares.take(kOne, Share::kInputs, 1);
    EXPECT_EQ(shares.taken(kOne, Share::kInputs), 1u);
  }
  EXPECT_EQ(shares.taken(kOne, Share::kInputs), 0u);
}

TEST(Shares, OfARobotWithOneUserMayBeGreater) {
  Shares shares(of_each(1600), 90, kDaemonsUser);
  std::vector<Charge> charges;
  EXPECT_EQ(take_all(shares, kOne, charges), 1350u);
  EXPECT_GT(take_all(shares, kTwo, charges), 100u);
}

TEST(Shares, CountWhatTheDaemonTakesAndDoNotRefuseIt) {
  Shares shares(of_each(1600), 50, kDaemonsUser);
  const Charge own = shares.take_own(Share::kSources, 1700);
  EXPECT_FALSE(shares.allows(kOne, Share::kSources, 1));
  EXPECT_TRUE(shares.allows(kOne, Share::kInputs, 1));
}

TEST(Shares, NothingMoreIsAllowedEvenToAUserWhoHasTooMuchByNow) {
  Shares shares(of_each(1600), 50, kDaemonsUser);
  std::vector<Charge> charges;
  take_all(shares, kOne, charges);
  take_all(shares, kTwo, charges);
  EXPECT_FALSE(shares.allows(kOne, Share::kClients, 1));
  EXPECT_TRUE(shares.allows(kOne, Share::kClients, 0));
}

TEST(Shares, NothingIsGivenBackOnce) {
  Shares shares(of_each(1600), 50, kDaemonsUser);
  Charge one = shares.take(kOne, Share::kDescriptors, 0);
  Charge other = shares.take(kOne, Share::kDescriptors, 0);
  EXPECT_FALSE(one);
  one = {};
  other = {};
  EXPECT_EQ(shares.taken(kOne, Share::kDescriptors), 0u);
}

TEST(Shares, ARefusalSaysWhatIsTheLimitAndWhatToDo) {
  Shares shares(of_each(16), 50, kDaemonsUser);
  const Charge some = shares.take(kOne, Share::kSources, 7);
  try {
    shares.take(kOne, Share::kSources);
    FAIL();
  } catch (const LimitExceeded& limit) {
    EXPECT_THAT(limit.what(),
                HasSubstr("limit-exceeded: user 1001 has 7 names of output ports that no model "
                          "names, of 16 (kMaxSources) for all users, 7 of them taken"));
    EXPECT_THAT(limit.what(), HasSubstr("--user-share"));
    EXPECT_THAT(limit.what(), HasSubstr("close some"));
  }
}

TEST(Shares, PromiseNoDescriptorThatMessagesMayNeed) {
  const Totals totals = totals_of_this_process();
  EXPECT_LT(totals[static_cast<std::size_t>(Share::kDescriptors)],
            Headroom::of_the_process().limit());
}

TEST(Shares, PassFromTheDaemonToAUserAsFarAsTheyAreHis) {
  Shares shares(of_each(1600), 50, kDaemonsUser);
  Charge one = shares.take_own(Share::kInputs, 700);
  Charge other = shares.take_own(Share::kInputs, 100);
  shares.pass_to(kOne, one, 100);
  EXPECT_TRUE(one.is_own());
  shares.pass_to(kOne, one);
  EXPECT_TRUE(one.is_of(kOne));
  shares.pass_to(kTwo, one);
  EXPECT_TRUE(one.is_of(kOne));
  shares.pass_to(kOne, other);
  EXPECT_TRUE(other.is_own());
}

TEST(Turns, AreByUserHoweverManyOfHisClientsWait) {
  Turns turns;
  for (std::uint64_t client = 1; client <= 100; ++client) turns.add(kOne, client);
  turns.add(kTwo, 200);
  turns.add(kTwo, 200);  // waits already
  std::vector<std::uint64_t> order;
  for (int i = 0; i < 4; ++i) order.push_back(*turns.next());
  EXPECT_EQ(order, (std::vector<std::uint64_t>{1, 200, 2, 3}));
  EXPECT_EQ(turns.users(), 1u);
}

TEST(WhatIsPutAside, CountsAsItsSendersAndIsClosedAsHisErrand) {
  Shares shares(of_each(1 << 20), 50, kDaemonsUser);
  wire::Received received;
  received.descriptors[0] = shm::make_segment("test", 1);
  received.descriptor_count = 1;
  const int number = received.descriptors[0].get();
  {
    const PutAside aside(received, kOne, shares);
    EXPECT_EQ(aside.received().descriptors[0].get(), number);
    EXPECT_EQ(shares.taken(kOne, Share::kDescriptors), 1u);
    EXPECT_GE(shares.taken(kOne, Share::kQueue), sizeof(wire::Message));
  }
  EXPECT_EQ(shares.taken(kOne, Share::kDescriptors), 0u);
  EXPECT_EQ(shares.taken(kOne, Share::kQueue), 0u);
  ASSERT_TRUE(wire::Errands::of_the_process().wait_until_done(shm::kForever / 2));
  EXPECT_EQ(::fcntl(number, F_GETFD), -1) << "it is still open";
}

TEST(WhatIsPutAside, CanWaitOnWhereThereIsRoomForItOnce) {
  Shares shares(of_each(3 * sizeof(wire::Received)), 50, kDaemonsUser);
  wire::Received received;
  PutAside aside(received, kOne, shares);
  EXPECT_THROW(PutAside(aside.received(), kOne, shares), LimitExceeded);
  aside.give_back();
  EXPECT_NO_THROW(PutAside(aside.received(), kOne, shares));
}

TEST(WhatIsPutAside, IsRefusedBeyondTheShareAndStaysWhatItWas) {
  Shares shares(of_each(1), 50, kDaemonsUser);
  wire::Received received;
  received.descriptors[0] = shm::make_segment("test", 1);
  received.descriptor_count = 1;
  EXPECT_THROW(PutAside(received, kOne, shares), LimitExceeded);
  EXPECT_TRUE(received.descriptors[0]);
}

TEST(Turns, ComeToAnEnd) {
  Turns turns;
  turns.add(kOne, 1);
  EXPECT_EQ(turns.next(), 1u);
  EXPECT_TRUE(turns.empty());
  EXPECT_FALSE(turns.next());
}

}  // namespace
}  // namespace arbiter::service
