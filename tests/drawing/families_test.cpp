#include "drawing/families.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <string>

#include "tests/rules/model_text.hpp"

namespace arbiter::drawing {
namespace {

using rules::Folder;
using testing::ElementsAre;
using testing::SizeIs;

class Drawn {
 public:
  explicit Drawn(const std::string& text) : model_(load(text)), hierarchy_(model_, ignored_) {}
  [[nodiscard]] Families families() const { return {model_, hierarchy_}; }

 private:
  static rules::Model load(const std::string& text) {
    const Folder folder;
    rules::Diagnostics diagnostics;
    auto texts = rules::read_texts({{folder.write("a.xml", text)}, {}});
    rules::LoadedModel loaded = rules::load_all(texts, diagnostics);
    EXPECT_FALSE(diagnostics.has_errors());
    return std::move(loaded.model);
  }

  const rules::Model model_;
  rules::Diagnostics ignored_;
  const rules::Hierarchy hierarchy_;
};

std::string behaviour(const std::string& name, const std::string& inhibits = {}) {
  return "<behavior name='" + name + "'><config at='/p" + name + "'>/" + name + "</config>" +
         (inhibits.empty() ? "" : "<inhibition>" + inhibits + "</inhibition>") + "</behavior>";
}

TEST(Families, LonersStandInColumnsBelowTheirHeads) {
  for (int count = 1; count <= 60; ++count) {
    SCOPED_TRACE(count);
    std::string text = "<behaviors>";
    for (int i = 0; i < count; ++i) text += behaviour("L" + std::to_string(i));
    const Drawn drawn(text + "</behaviors>");
    const Families families = drawn.families();
    ASSERT_THAT(families.top().units, SizeIs(1));
    const Unit& unit = families.top().units[0];
    EXPECT_FALSE(unit.is_framed());
    std::vector<std::size_t> heads;
    for (std::size_t i = 0; i < unit.members.size(); i += unit.height) {
      heads.push_back(unit.members[i]);
    }
    EXPECT_EQ(unit.tops, heads);
    EXPECT_EQ(unit.bottoms.size(), heads.size());
    EXPECT_EQ(unit.bottoms.back(), unit.members.back());
  }
}

TEST(Families, AnArrowToAGroupStandsForOneToEach) {
  const Drawn drawn("<behaviors>" + behaviour("Stop", "A,B,C") + behaviour("A") + behaviour("B") +
                    behaviour("C") + "</behaviors>");
  const Families families = drawn.families();
  ASSERT_THAT(families.top().units, SizeIs(2));
  EXPECT_TRUE(families.top().units[1].is_framed());
  ASSERT_THAT(families.top().arrows, SizeIs(1));
  EXPECT_THAT(families.top().arrows[0].inhibitions, SizeIs(3));
}

TEST(Families, ABoxIsAsHighAsWhatIsInIt) {
  const Drawn drawn(
      "<behaviors><meta_behavior name='Box'><behavior>A</behavior><behavior>B</behavior>"
      "</meta_behavior>" +
      behaviour("A", "B") + behaviour("B") + "</behaviors>");
  const Families families = drawn.families();
  ASSERT_THAT(families.top().units, SizeIs(1));
  const Unit& box = families.top().units[0];
  EXPECT_TRUE(box.is_box);
  EXPECT_EQ(box.extent.width, 1);
  EXPECT_EQ(box.extent.height, 2.5);
  EXPECT_THAT(box.tops, ElementsAre(1u));
  EXPECT_THAT(box.bottoms, ElementsAre(2u));
}

// Of what leads to the next column its end may stand as high as its beginning, or higher.
TEST(Families, ALongListIsFoldedIntoColumns) {
  std::string text = "<behaviors>";
  for (int i = 0; i < 40; ++i) {
    text += behaviour("L" + std::to_string(i), i < 39 ? "L" + std::to_string(i + 1) : "");
  }
  const Drawn drawn(text + "</behaviors>");
  const Families families = drawn.families();
  ASSERT_THAT(families.top().folds, SizeIs(1));
  EXPECT_THAT(families.top().folds[0], ElementsAre(0u, 8u, 16u, 24u, 32u));
  for (const Arrow& arrow : families.top().arrows) {
    EXPECT_EQ(arrow.leads_back, arrow.to % 8 == 0) << arrow.to;
  }
}

}  // namespace
}  // namespace arbiter::drawing
