// How large a sample may be that begins with such a header, if its type has one size.
#include "gateway/mapping/encapsulation.hpp"

#include <gtest/gtest.h>

#include <array>

namespace arbiter::gateway {
namespace {

Encapsulation of_kind(int kind) {
  const std::array<std::byte, 4> header{std::byte{0}, static_cast<std::byte>(kind)};
  return read_encapsulation(header);
}

TEST(Encapsulation, APlainSampleHasTheSizeOfItsTypePaddedOrNot) {
  for (const int kind : {0, 1, 6, 7}) {
    EXPECT_TRUE(may_have(of_kind(kind), 48, 48));
    EXPECT_FALSE(may_have(of_kind(kind), 44, 48));
    EXPECT_FALSE(may_have(of_kind(kind), 52, 48));
    EXPECT_TRUE(may_have(of_kind(kind), 1, 1));
    EXPECT_TRUE(may_have(of_kind(kind), 4, 1));
    EXPECT_FALSE(may_have(of_kind(kind), 0, 1));
    EXPECT_FALSE(may_have(of_kind(kind), 8, 1));
  }
}

// By how many depends on what nobody here knows of the type.
TEST(Encapsulation, OtherEncodingsAddBytes) {
  for (const int kind : {2, 3, 8, 9, 10, 11}) {
    EXPECT_TRUE(may_have(of_kind(kind), 48, 48));
    EXPECT_TRUE(may_have(of_kind(kind), 60, 48));
    EXPECT_FALSE(may_have(of_kind(kind), 44, 48));
  }
}

}  // namespace
}  // namespace arbiter::gateway
