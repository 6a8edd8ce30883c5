// What is warned of is said once, and later where there is no room for it now.
#include "gateway/dds/warnings.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <string>

#include "gateway/dds/repeats.hpp"

namespace arbiter::gateway::dds {
namespace {

using ::testing::ElementsAre;
using ::testing::IsEmpty;

constexpr Guid kOne = {1};
constexpr Guid kTwo = {2};
const PeerMap kBoth = {{kOne, {}}, {kTwo, {}}};

TEST(Warnings, AreSaidOnce) {
  Quota quota(10, 100);
  Warnings warnings;
  warnings.set({{kOne, "a"}, {kTwo, "a"}}, kBoth);
  EXPECT_THAT(warnings.take(quota, 0), ElementsAre("a", "a"));
  EXPECT_THAT(warnings.take(quota, 1), IsEmpty());
  warnings.set({{kOne, "a"}, {kTwo, "b"}}, kBoth);
  EXPECT_THAT(warnings.take(quota, 2), ElementsAre("b"));
  warnings.set({}, kBoth);             // it has been mended,
  warnings.set({{kTwo, "b"}}, kBoth);  // and broken again
  EXPECT_THAT(warnings.take(quota, 3), IsEmpty());
}

TEST(Warnings, WaitForRoom) {
  Quota quota(1, 100);
  Warnings warnings;
  warnings.set({{kOne, "a"}, {kTwo, "b"}}, kBoth);
  EXPECT_THAT(warnings.take(quota, 0), ElementsAre("a"));
  EXPECT_THAT(warnings.take(quota, 99), IsEmpty());
  warnings.set({{kOne, "a"}, {kTwo, "b"}}, kBoth);  // somebody else has come
  EXPECT_THAT(warnings.take(quota, 100), ElementsAre("b"));
  EXPECT_EQ(quota.take(200), 0U);  // nothing was left out
}

TEST(Warnings, ThatAreNoLongerTrueAreNotSaid) {
  Quota quota(1, 100);
  Warnings warnings;
  warnings.set({{kOne, "a"}, {kTwo, "b"}}, kBoth);
  EXPECT_THAT(warnings.take(quota, 0), ElementsAre("a"));
  warnings.set({{kOne, "a"}}, kBoth);
  EXPECT_THAT(warnings.take(quota, 100), IsEmpty());
}

TEST(Warnings, OfOneThatCameBackAreSaidAgain) {
  Quota quota(10, 100);
  Warnings warnings;
  warnings.set({{kOne, "a"}}, kBoth);
  EXPECT_THAT(warnings.take(quota, 0), ElementsAre("a"));
  warnings.set({}, {});
  warnings.set({{kOne, "a"}}, kBoth);
  EXPECT_THAT(warnings.take(quota, 1), ElementsAre("a"));
}

TEST(Warnings, OfAPeerThatChangesForEverHaveAnEnd) {
  Quota quota(1000, 100);
  Warnings warnings;
  std::size_t said = 0;
  for (int i = 0; i < 100; ++i) {
    warnings.set({{kOne, std::to_string(i)}}, kBoth);
    said += warnings.take(quota, i).size();
  }
  EXPECT_EQ(said, 16U);
}

TEST(Repeats, AreCountedAndSaidOnceAWhile) {
  Repeats repeats(100);
  EXPECT_TRUE(repeats.is_due("a", 1));
  EXPECT_TRUE(repeats.is_due("a", 2)) << "it has not been said: there was no room";
  EXPECT_EQ(repeats.note("a", 2), 0U);
  EXPECT_FALSE(repeats.is_due("a", 3));
  EXPECT_TRUE(repeats.is_due("b", 3));
  EXPECT_FALSE(repeats.is_due("a", 101));
  EXPECT_TRUE(repeats.is_due("a", 102));
  EXPECT_EQ(repeats.note("a", 102), 2U);
  EXPECT_EQ(repeats.note("a", 202), 0U);
}

TEST(Repeats, OfMoreThanAreRememberedAreSaid) {
  Repeats repeats(1000);
  for (int i = 0; i < 17; ++i) EXPECT_EQ(repeats.note(std::to_string(i), 1 + i), 0U);
  EXPECT_FALSE(repeats.is_due("16", 20));
  EXPECT_TRUE(repeats.is_due("0", 20));
}

}  // namespace
}  // namespace arbiter::gateway::dds
