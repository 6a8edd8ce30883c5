#include "drawing/text.hpp"

#include <gtest/gtest.h>

namespace arbiter::drawing {
namespace {

TEST(Text, ThatIsTooLongLosesItsMiddle) {
  EXPECT_EQ(shortened("/Gaze/pos:i", 11), "/Gaze/pos:i");
  EXPECT_EQ(shortened("/Gaze/pos:i", 8), "/Ga…os:i");
  EXPECT_EQ(shortened("", 8), "");
}

TEST(Text, IsCutBetweenCharacters) {
  EXPECT_EQ(shortened("ääääöööö", 5), "ää…öö");
  EXPECT_EQ(shortened("\xff\xff\xff\xff", 3), "\xff…\xff");
}

TEST(Text, OfAFormulaIsBrokenInFrontOfItsOperators) {
  EXPECT_EQ(in_lines("/a ∧ ¬/b ∨ /c", 80, 3), "/a ∧ ¬/b ∨ /c");
  EXPECT_EQ(in_lines("/aaaa ∧ ¬/bbbb ∨ /cccc", 10, 3), "/aaaa\n     ∧ ¬/bbbb\n     ∨ /cccc");
  EXPECT_EQ(in_lines("/aaaa ∧ ¬/bbbb ∨ /cccc", 10, 2), "/aaaa\n     ∧ ¬/bbbb …");
  EXPECT_EQ(in_lines("", 8, 2), "");
}

TEST(Text, OfAFormulaOfOneLongNameIsShortened) {
  EXPECT_EQ(in_lines("/aaaaaaaaaaaaaaaaaaaaaaaa:o", 9, 3), "/aaa…aa:o");
}

}  // namespace
}  // namespace arbiter::drawing
