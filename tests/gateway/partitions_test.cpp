// Partitions by DDS' rules: names, patterns, and the one without a name.
#include "gateway/mapping/partitions.hpp"

#include <gtest/gtest.h>

namespace arbiter::gateway {
namespace {

TEST(Partition, NamesPatternsAndTheDefaultOne) {
  using Names = std::vector<std::string>;
  EXPECT_TRUE(share_partition({}, {}));
  EXPECT_TRUE(share_partition({}, Names{""}));
  EXPECT_TRUE(share_partition({}, Names{"*"}));
  EXPECT_FALSE(share_partition({}, Names{"a"}));
  EXPECT_TRUE(share_partition(Names{"a", "b"}, Names{"b", "c"}));
  EXPECT_FALSE(share_partition(Names{"a"}, Names{"A"}));
  EXPECT_TRUE(share_partition(Names{"robot?"}, Names{"robot1"}));
  EXPECT_FALSE(share_partition(Names{"robot?"}, Names{"robot"}));
  EXPECT_TRUE(share_partition(Names{"front/left"}, Names{"f*/*t"}));
  EXPECT_FALSE(share_partition(Names{"a*"}, Names{"*a"}));  // two patterns
  EXPECT_FALSE(share_partition(Names{"a*"}, Names{"a*"}));
}

TEST(Partition, APatternThatIsMadeToBeSlowIsNot) {
  std::string pattern;
  for (int i = 0; i < 60; ++i) pattern += "a*";
  EXPECT_FALSE(share_partition({pattern + "b"}, {std::string(200, 'a')}));
}

}  // namespace
}  // namespace arbiter::gateway
