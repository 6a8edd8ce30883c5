// Sections VI and VII, Discussions and Conclusion.
#include <gmock/gmock.h>

#include "tests/paper/paper_model.hpp"

namespace arbiter::test {
namespace {

using testing::ElementsAre;

// "Behaviors can also help each other to become active by enabling the relevant connections."
TEST(Section6, ABehaviourCanEnableTheConnectionsOfAnother) {
  const auto model = load_text(R"(<behaviors>
    <behavior name="Grasp"><config at="/Hand/pos:i">/Grasp/pos:o</config>
      <condition>/Object/pos:o</condition></behavior>
    <behavior name="Track Object"><config at="/Arm/pos:i">/Object/pos:o</config></behavior>
  </behaviors>)");
  EXPECT_EQ(model.winner("/Hand/pos:i", {"/Grasp/pos:o"}), "-");
  EXPECT_EQ(model.winner("/Hand/pos:i", {"/Grasp/pos:o", kObject}), "/Grasp/pos:o");
}

// Named as future work: "validation of the model and checking the consistency of the rules which
// are extracted from the behavioral description".
TEST(Section7, RulesThatContradictEachOtherAreFoundWhenAModelIsChecked) {
  const auto model = load_text(R"(<behaviors>
    <behavior name="Look Around"><config at="/Gaze/pos:i">/RandomLook/pos:o</config></behavior>
    <behavior name="Follow Face"><config at="/Gaze/pos:i">/Face/pos:o</config>
      <condition>not /collision:o</condition></behavior>
  </behaviors>)");
  ASSERT_THAT(model.codes(), ElementsAre("both-can-win"));
  const auto& conflict = model.diagnostics.items()[0];
  EXPECT_THAT(conflict.witness->active, ElementsAre(kFace, kRandomLook));
  EXPECT_THAT(conflict.witness->inactive, ElementsAre(kCollision));
}

TEST(Section7, ABehaviourThatCanNeverRunIsFoundToo) {
  const auto model = load_text(R"(<behaviors>
    <meta_behavior name="Calm"><behavior>Rest Arm</behavior><condition>not /collision:o</condition>
    </meta_behavior>
    <behavior name="Rest Arm"><config at="/Arm/pos:i">/RestArm/pos:o</config>
      <condition>/collision:o</condition></behavior>
  </behaviors>)");
  EXPECT_FALSE(model.diagnostics.has_errors());
  EXPECT_THAT(model.codes(), testing::UnorderedElementsAre("never-selected", "never-runs",
                                                           "unreachable-children"));
}

}  // namespace
}  // namespace arbiter::test
