#include "drawing/siblings.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace arbiter::drawing {
namespace {

using testing::Each;
using testing::ElementsAre;

TEST(Siblings, OfAListOfPrioritiesOnlyTheNextOneIsNoDetour) {
  EXPECT_THAT(find_detours(3, {{0, 1}, {0, 2}, {1, 2}}), ElementsAre(false, true, false));
  EXPECT_THAT(find_detours(4, {{0, 3}, {0, 1}, {1, 2}, {2, 3}}),
              ElementsAre(true, false, false, false));
}

TEST(Siblings, TwoWaysOfEqualLengthAreNoDetours) {
  EXPECT_THAT(find_detours(4, {{0, 1}, {0, 2}, {1, 3}, {2, 3}}), Each(false));
}

TEST(Siblings, InACircleNothingIsADetour) {
  EXPECT_THAT(find_detours(3, {{0, 1}, {1, 2}, {2, 0}, {0, 2}}), Each(false));
  EXPECT_THAT(find_detours(2, {{0, 1}, {1, 0}}), Each(false));
}

// Whatever is left out leads nowhere that the others do not lead to: by trying all graphs of four.
TEST(Siblings, WithoutDetoursTheSameCanBeReached) {
  const auto reaches = [](const Inhibitions& edges) {
    std::vector<std::vector<bool>> reached(4, std::vector<bool>(4, false));
    for (const auto& [from, to] : edges) reached[from][to] = true;
    for (std::size_t k = 0; k < 4; ++k) {
      for (std::size_t i = 0; i < 4; ++i) {
        for (std::size_t j = 0; j < 4; ++j) {
          if (reached[i][k] && reached[k][j]) reached[i][j] = true;
        }
      }
    }
    return reached;
  };
  int detours_found = 0;
  for (unsigned mask = 0; mask < 1u << 12; ++mask) {
    Inhibitions all, kept;
    unsigned bit = 0;
    for (std::size_t i = 0; i < 4; ++i) {
      for (std::size_t j = 0; j < 4; ++j) {
        if (i != j && (mask >> bit++ & 1) != 0) all.emplace_back(i, j);
      }
    }
    const auto detours = find_detours(4, all);
    for (std::size_t e = 0; e < all.size(); ++e) {
      if (!detours[e]) kept.push_back(all[e]);
      detours_found += detours[e] ? 1 : 0;
    }
    EXPECT_EQ(reaches(kept), reaches(all)) << mask;
  }
  EXPECT_GT(detours_found, 100);
}

TEST(Siblings, LonersStandInColumns) {
  EXPECT_THAT(arrange_loners(9, {}),
              ElementsAre(ElementsAre(0, 1, 2), ElementsAre(3, 4, 5), ElementsAre(6, 7, 8)));
  EXPECT_THAT(arrange_loners(5, {{0, 3}}), ElementsAre(ElementsAre(1, 2), ElementsAre(4)));
  EXPECT_THAT(arrange_loners(2, {{0, 1}}), testing::IsEmpty());
}

}  // namespace
}  // namespace arbiter::drawing
