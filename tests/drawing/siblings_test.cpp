#include "drawing/siblings.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <set>

namespace arbiter::drawing {
namespace {

using testing::Each;
using testing::ElementsAre;
using testing::SizeIs;

using enum Stroke;

TEST(Siblings, OfAListOfPrioritiesOnlyTheNextOneNeedsAnArrow) {
  EXPECT_THAT(find_strokes(3, {{0, 1}, {0, 2}, {1, 2}}), ElementsAre(kDirect, kImplied, kDirect));
  EXPECT_THAT(find_strokes(4, {{0, 3}, {0, 2}, {0, 1}, {1, 2}, {2, 3}}),
              ElementsAre(kImplied, kImplied, kDirect, kDirect, kDirect));
}

// The arrows of 0 lead to 1, 2 and 3, and it does not inhibit 2.
TEST(Siblings, WhoInhibitsNotAllThatItsArrowsLeadToHasAnArrowForEach) {
  EXPECT_THAT(find_strokes(4, {{0, 3}, {0, 1}, {1, 2}, {2, 3}}),
              ElementsAre(kPast, kDirect, kDirect, kDirect));
}

TEST(Siblings, TwoWaysOfEqualLengthAreDirect) {
  EXPECT_THAT(find_strokes(4, {{0, 1}, {0, 2}, {1, 3}, {2, 3}}), Each(kDirect));
}

TEST(Siblings, InACircleAllAreDirect) {
  EXPECT_THAT(find_strokes(3, {{0, 1}, {1, 2}, {2, 0}, {0, 2}}), Each(kDirect));
  EXPECT_THAT(find_strokes(2, {{0, 1}, {1, 0}}), Each(kDirect));
}

using Matrix = std::vector<std::vector<bool>>;

Matrix reached_by(std::size_t siblings, const Inhibitions& edges) {
  Matrix reached(siblings, std::vector<bool>(siblings, false));
  for (const auto& [from, to] : edges) reached[from][to] = true;
  for (std::size_t k = 0; k < siblings; ++k) {
    for (std::size_t i = 0; i < siblings; ++i) {
      for (std::size_t j = 0; j < siblings; ++j) {
        if (reached[i][k] && reached[k][j]) reached[i][j] = true;
      }
    }
  }
  return reached;
}

// What a reader takes from the picture is what there is: by trying all graphs of four.
TEST(Siblings, FromArrowsAndMarksAllInhibitionsCanBeRead) {
  int implied_found = 0, past_found = 0;
  for (unsigned mask = 0; mask < 1u << 12; ++mask) {
    Inhibitions all, drawn;
    unsigned bit = 0;
    for (std::size_t i = 0; i < 4; ++i) {
      for (std::size_t j = 0; j < 4; ++j) {
        if (i != j && (mask >> bit++ & 1) != 0) all.emplace_back(i, j);
      }
    }
    const auto strokes = find_strokes(4, all);
    std::vector<bool> is_marked(4);
    for (std::size_t e = 0; e < all.size(); ++e) {
      if (strokes[e] == kImplied) {
        is_marked[all[e].first] = true;
        ++implied_found;
      } else {
        drawn.push_back(all[e]);
        past_found += strokes[e] == kPast ? 1 : 0;
      }
    }
    const Matrix reached = reached_by(4, drawn);
    std::set<std::pair<std::size_t, std::size_t>> read(drawn.begin(), drawn.end());
    for (std::size_t i = 0; i < 4; ++i) {
      for (std::size_t j = 0; j < 4; ++j) {
        if (is_marked[i] && reached[i][j]) read.emplace(i, j);
      }
    }
    EXPECT_EQ(read, (std::set<std::pair<std::size_t, std::size_t>>(all.begin(), all.end())))
        << mask;
    EXPECT_EQ(reached, reached_by(4, all)) << mask;
  }
  EXPECT_GT(implied_found, 100);
  EXPECT_GT(past_found, 10);
}

TEST(Siblings, ThoseWhoAreAlikeAreAGroup) {
  const std::vector<bool> all(5, true);
  EXPECT_THAT(find_twins({{0, 1}, {0, 2}, {0, 3}, {1, 4}, {2, 4}, {3, 4}}, all),
              ElementsAre(ElementsAre(0), ElementsAre(1, 2, 3), ElementsAre(4)));
  // Two are too few, and a box joins nobody.
  EXPECT_THAT(find_twins({{0, 1}, {0, 2}}, std::vector<bool>(3, true)), SizeIs(3));
  EXPECT_THAT(find_twins({{0, 1}, {0, 2}, {0, 3}}, {true, false, true, true}), SizeIs(4));
}

TEST(Siblings, LonersAreAGroupHoweverFew) {
  EXPECT_THAT(find_twins({{0, 1}}, std::vector<bool>(4, true)),
              ElementsAre(ElementsAre(0), ElementsAre(1), ElementsAre(2, 3)));
}

TEST(Siblings, ThoseWhoInhibitEachOtherAreAGroup) {
  EXPECT_THAT(find_twins({{0, 1}, {0, 2}, {1, 0}, {1, 2}, {2, 0}, {2, 1}, {0, 3}, {1, 3}, {2, 3}},
                         std::vector<bool>(4, true)),
              ElementsAre(ElementsAre(0, 1, 2), ElementsAre(3)));
  // A circle is none.
  EXPECT_THAT(find_twins({{0, 1}, {1, 2}, {2, 0}}, std::vector<bool>(3, true)), SizeIs(3));
}

TEST(Siblings, PiecesAreWhatInhibitionsConnect) {
  EXPECT_THAT(find_pieces(6, {{4, 1}, {1, 3}, {5, 0}}),
              ElementsAre(ElementsAre(0, 5), ElementsAre(1, 3, 4), ElementsAre(2)));
}

TEST(Siblings, RanksCountTheLongestWay) {
  EXPECT_THAT(find_ranks(4, {{0, 1}, {1, 2}, {0, 2}}), ElementsAre(0, 1, 2, 0));
  EXPECT_THAT(find_ranks(2, {{0, 1}, {1, 0}}), Each(0));
}

TEST(Siblings, ManyPiecesStandInRows) {
  const auto rows = arrange_in_rows(std::vector<Extent>(10, {1, 4}));
  ASSERT_THAT(rows, SizeIs(2));
  EXPECT_THAT(rows[0], SizeIs(5));
  EXPECT_THAT(arrange_in_rows({{5, 20}, {1, 1}}), SizeIs(1));
  EXPECT_THAT(arrange_in_rows({}), testing::IsEmpty());
}

TEST(Siblings, AListOfFortyIsFoldedAndATreeOfFortyIsNot) {
  EXPECT_EQ(columns_of_fold({1, 40}), 5u);
  EXPECT_EQ(columns_of_fold({1, 12}), 1u);
  EXPECT_EQ(columns_of_fold({6, 24}), 1u);
}

}  // namespace
}  // namespace arbiter::drawing
