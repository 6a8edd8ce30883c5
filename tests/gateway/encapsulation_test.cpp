// How large a sample may be that begins with such a header, if its type has one size.
#include "gateway/mapping/encapsulation.hpp"

#include <gtest/gtest.h>

#include <array>

namespace arbiter::gateway {
namespace {

Encapsulation of_kind(int kind, int options = 0) {
  const std::array<std::byte, 4> header{std::byte{0}, static_cast<std::byte>(kind), std::byte{0},
                                        static_cast<std::byte>(options)};
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

// A type that has lost its last fields would otherwise be taken for one that has them, all zero.
TEST(Encapsulation, WhatASampleIsPaddedWithIsNoneOfItsData) {
  for (const int kind : {0, 1, 6, 7}) {
    EXPECT_TRUE(may_have(of_kind(kind, 3), 4, 1));
    EXPECT_FALSE(may_have(of_kind(kind, 3), 4, 2));
    EXPECT_FALSE(may_have(of_kind(kind, 3), 4, 4));
    EXPECT_TRUE(may_have(of_kind(kind, 2), 48, 46));
    EXPECT_FALSE(may_have(of_kind(kind, 2), 48, 48));
    EXPECT_TRUE(may_have(of_kind(kind, 3), 1, 1)) << "it was padded before";
    EXPECT_FALSE(may_have(of_kind(kind, 3), 0, 1));
  }
  EXPECT_FALSE(may_have(of_kind(9, 1), 48, 48));
  EXPECT_TRUE(may_have(of_kind(9, 1), 52, 48));
  // The other bits mean something else.
  EXPECT_EQ(of_kind(7, 0xfc).padding, 0u);
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
