// Names and texts of others, before a person or a program reads them.
#include "shm/utf8.hpp"

#include <gtest/gtest.h>

#include <string>

#include "shm/limits.hpp"

namespace arbiter::shm {
namespace {

std::string fault(const std::string& name) {
  const auto found = find_fault_in_name(name);
  return found ? std::string(found->what) + " at " + std::to_string(found->at) : "none";
}

TEST(Utf8, ANameMayHaveLettersOfAnyScript) {
  EXPECT_EQ(fault("/Gaze/pos:i"), "none");
  EXPECT_EQ(fault("/Kopf/Öl:o"), "none");
  EXPECT_EQ(fault("/顔/位置:o"), "none");
}

TEST(Utf8, ANameThatWouldBreakALineOrMisleadItsReaderIsRefusedWithThePlace) {
  EXPECT_EQ(fault("/a b"), "white space at 2");
  EXPECT_EQ(fault("/a\nb"), "white space at 2");
  EXPECT_EQ(fault("/a\x1b[2J"), "an invisible character at 2");
  EXPECT_EQ(fault("/a\x7f"), "an invisible character at 2");
  EXPECT_EQ(fault("/\u009b31m"), "an invisible character at 1");  // a terminal's escape, in one
  EXPECT_EQ(fault("/\u00a0"), "an invisible character at 1");
  EXPECT_EQ(fault("/\u202e"), "an invisible character at 1");  // turns what follows around
  EXPECT_EQ(fault("/\u2066x"), "an invisible character at 1");
  EXPECT_EQ(fault("/\U000e0041"), "an invisible character at 1");
  EXPECT_EQ(fault("/\"x\""), "a double quote at 1");
  EXPECT_EQ(fault("/a\xff"), "a byte that is not UTF-8 at 2");
  EXPECT_EQ(fault("/a\xc3"), "a byte that is not UTF-8 at 2");
}

TEST(Utf8, APortsNameBeginsWithASlash) {
  for (const char* const name : {"/", "/Gaze/pos:i", "/顔/位置:o"}) EXPECT_TRUE(is_port_name(name));
  for (const char* const name : {"", "a", "\"/a\"", "/a b"})
    EXPECT_FALSE(is_port_name(name)) << name;
  const std::string longest = "/" + std::string(kMaxNameLength - 1, 'a');
  EXPECT_TRUE(is_port_name(longest));
  EXPECT_FALSE(is_port_name(longest + "a"));
}

TEST(Utf8, WhatIsPrintedCannotForgeALineNorSteerATerminal) {
  EXPECT_EQ(printable("plain, Öl"), "plain, Öl");
  EXPECT_EQ(printable("a\nb\tc"), "a\\nb\\x09c");
  EXPECT_EQ(printable("a\nb\tc", "\n\t"), "a\nb\tc");
  EXPECT_EQ(printable("\x1b[31m\u009b"), "\\x1b[31m\\xc2\\x9b");
  EXPECT_EQ(printable("a\u202eb\u2028c"), "a\\xe2\\x80\\xaeb\\xe2\\x80\\xa8c");
  EXPECT_EQ(printable("\xff\xc3"), "\\xff\\xc3");
  EXPECT_EQ(printable(std::string_view("\0x", 2)), "\\x00x");
}

}  // namespace
}  // namespace arbiter::shm
