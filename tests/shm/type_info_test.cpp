// When two types are equal, and what is said where they are not.
#include "shm/type_info.hpp"

#include <gtest/gtest.h>

#include "wire/messages.hpp"

namespace arbiter::shm {
namespace {

TypeInfo type(std::string_view name, std::uint64_t size, std::uint64_t alignment) {
  TypeInfo info;
  info.set_name(name);
  info.size = size;
  info.alignment = alignment;
  return info;
}

TEST(TypeInfo, IsEqualWhereNameSizeAndAlignmentAre) {
  EXPECT_EQ(type("a", 8, 8), type("a", 8, 8));
  EXPECT_FALSE(type("a", 8, 8) == type("A", 8, 8));
  EXPECT_FALSE(type("a", 8, 8) == type("a", 16, 8));
  EXPECT_FALSE(type("a", 8, 8) == type("a", 8, 4));
}

TEST(TypeInfo, WhatLiesBehindTheNamesEndDoesNotMatter) {
  TypeInfo one = type("abc", 8, 8);
  one.set_name("a");
  one.name[2] = 'z';
  EXPECT_EQ(one, type("a", 8, 8));
}

// An untyped input port takes all; what a typed one takes, its publisher must say.
TEST(TypeInfo, FitsWhereEqualOrUntyped) {
  EXPECT_EQ(type_mismatch(type("a", 8, 8), type("a", 8, 8)), "");
  EXPECT_EQ(type_mismatch(type("a", 8, 8), type("", 0, 1)), "");
  EXPECT_EQ(type_mismatch(type("", 4096, 16), type("", 0, 1)), "");
  EXPECT_NE(type_mismatch(type("", 8, 8), type("a", 8, 8)), "");
}

TEST(TypeInfo, AMismatchNamesBothSoThatNobodyIsMisled) {
  EXPECT_EQ(type_mismatch(type("Twist\x1b[2J", 1, 1), type("Pose\n", 24, 8), "joy\x1b", "base"),
            "the output port of \"joy\\x1b\" sends Twist\\x1b[2J (1 byte, aligned to 1), the input "
            "port of \"base\" takes Pose\\n (24 bytes, aligned to 8)");
}

// Of two names of the greatest length the last bytes are told, too, whatever the nodes are called.
TEST(TypeInfo, AMismatchOfTheLongestNamesFitsIntoAMessage) {
  const std::string long_name(kMaxTypeName - 1, 'x');
  std::string node;
  while (node.size() + 2 <= kMaxNameLength) node += "\u00e4";
  const std::string why =
      type_mismatch(type(long_name + "a", kMaxTypeSize, kMaxAlignment),
                    type(long_name + "b", kMaxTypeSize, kMaxAlignment), node, node);
  wire::Message message;
  message.set_text(std::string(kMaxNameLength, 'p') + why);
  EXPECT_NE(message.text_view().find(long_name + "a ("), std::string::npos);
  message.set_text(why);
  EXPECT_EQ(message.text_view(), why);
  EXPECT_NE(why.find(long_name + "b ("), std::string::npos);
  EXPECT_NE(why.find("\u00e4...\""), std::string::npos) << "cut between two characters";
}

TEST(TypeInfo, NamesAreUtf8WithoutWhatMisleads) {
  EXPECT_FALSE(fault_of(type("unsigned int", 4, 4)));
  EXPECT_FALSE(fault_of(type("\u00d6l/Druck", 4, 4)));
  EXPECT_FALSE(fault_of(type("", 0, 1))) << "untyped";
  for (const char* name : {"a\tb", "a\x7f", "a\u0085", "a\u200b", "\xc3", "\xff"}) {
    EXPECT_TRUE(fault_of(type(name, 4, 4))) << name;
  }
  TypeInfo unterminated = type("", 4, 4);
  std::memset(unterminated.name, 'x', sizeof unterminated.name);
  EXPECT_EQ(unterminated.type_name().size(), kMaxTypeName);
  EXPECT_FALSE(fault_of(unterminated));
}

TEST(TypeInfo, SizesAndAlignmentsAreBounded) {
  EXPECT_TRUE(fault_of(type("a", 0, 1)));
  EXPECT_FALSE(fault_of(type("a", kMaxTypeSize, kMaxAlignment)));
  EXPECT_TRUE(fault_of(type("a", kMaxTypeSize + 1, 1)));
  EXPECT_FALSE(fault_of(type("a", 1, 0))) << "it is variable";
  EXPECT_TRUE(fault_of(type("", 1, 0)));
  EXPECT_TRUE(fault_of(type("a", 1, 24)));
  EXPECT_TRUE(fault_of(type("a", 1, 2 * kMaxAlignment)));
}

}  // namespace
}  // namespace arbiter::shm
