// Section IV, Modeling the behaviors: configuration, condition and inhibition.
#include <gmock/gmock.h>

#include "tests/paper/paper_model.hpp"

namespace arbiter::test {
namespace {

using testing::Contains;
using testing::ElementsAre;
using testing::IsEmpty;

// Figure 3, by activity: what the text says of each behaviour.
std::string expected_gaze(const std::set<std::string>& active) {
  if (active.contains(kObject)) return active.contains(kCollision) ? "-" : kObject;
  if (active.contains(kFace)) return kFace;
  return active.contains(kRandomLook) ? kRandomLook : "-";
}
std::string expected_arm(const std::set<std::string>& active) {
  if (active.contains(kObject)) return active.contains(kCollision) ? "-" : kObject;
  return active.contains(kRestArm) ? kRestArm : "-";
}

TEST(Section4, Figure3SearchAndTrackDecidesAsDescribedUnderEachActivation) {
  const auto model = search_and_track();
  EXPECT_THAT(model.codes(), IsEmpty());
  for (const auto& active : subsets(kAllSources)) {
    EXPECT_EQ(model.winner(kGaze, active), expected_gaze(active)) << testing::PrintToString(active);
    EXPECT_EQ(model.winner(kArm, active), expected_arm(active)) << testing::PrintToString(active);
    model.live->activate_only(active);
    EXPECT_LE(model.live->winners(kGaze).size(), 1u);
    EXPECT_LE(model.live->winners(kArm).size(), 1u);
  }
}

TEST(Section4, FollowFaceHasAHigherPriorityThanLookAround) {
  const auto model = load_text(R"(
    <behavior name="Look Around"><config at="/Gaze/pos:i">/RandomLook/pos:o</config></behavior>
    <behavior name="Follow Face"><config at="/Gaze/pos:i">/Face/pos:o</config>
      <inhibition>Look Around</inhibition></behavior>)");
  EXPECT_EQ(model.winner(kGaze, {kRandomLook}), kRandomLook);
  EXPECT_EQ(model.winner(kGaze, {kFace}), kFace);
  EXPECT_EQ(model.winner(kGaze, {kRandomLook, kFace}), kFace);
}

TEST(Section4, AConfigurationSelectsTheConnectionsThatImplementTheBehaviour) {
  const auto model = load_text(R"(
    <behavior name="Track Object">
      <config at="/Gaze/pos:i">/Object/pos:o</config>
      <config at="/Arm/pos:i">/Object/pos:o</config>
    </behavior>)");
  EXPECT_THAT(model.rules_at(kGaze), ElementsAre(kObject));
  EXPECT_THAT(model.rules_at(kArm), ElementsAre(kObject));
}

TEST(Section4, AConditionHoldsForAllConnectionsOfItsBehaviour) {
  const auto model = search_and_track();
  EXPECT_THAT(model.rules_at(kGaze), Contains("/Object/pos:o ∧ ¬/collision:o"));
  EXPECT_THAT(model.rules_at(kArm), Contains("/Object/pos:o ∧ ¬/collision:o"));
}

TEST(Section4, ConditionsOfAllParentsAreConjoinedAndInherited) {
  const auto model = load_text(R"(<behaviors>
    <meta_behavior name="Outer"><behavior>Inner</behavior><condition>/outer:o</condition>
    </meta_behavior>
    <meta_behavior name="Inner"><behavior>Child</behavior><condition>not /inner:o</condition>
    </meta_behavior>
    <behavior name="Child"><config at="/p">/child:o</config><condition>/own:o</condition>
    </behavior>
  </behaviors>)");
  for (const auto& active : subsets({"/child:o", "/own:o", "/inner:o", "/outer:o"})) {
    const bool runs = active.contains("/child:o") && active.contains("/own:o") &&
                      !active.contains("/inner:o") && active.contains("/outer:o");
    EXPECT_EQ(model.winner("/p", active), runs ? "/child:o" : "-");
  }
}

TEST(Section4, InhibitingAMetaBehaviourInhibitsAllBehavioursInIt) {
  const auto model = search_and_track();
  EXPECT_EQ(model.winner(kGaze, {kObject, kFace}), kObject);
  EXPECT_EQ(model.winner(kGaze, {kObject, kRandomLook}), kObject);
  EXPECT_EQ(model.winner(kGaze, {kObject, kFace, kRandomLook}), kObject);
}

TEST(Section4, AMetaBehaviourInhibitsABehaviourAndAnotherMetaBehaviour) {
  const auto model = load_text(R"(<behaviors>
    <meta_behavior name="Strong"><behavior>S1</behavior><behavior>S2</behavior>
      <inhibition>Weak, Alone</inhibition></meta_behavior>
    <meta_behavior name="Weak"><behavior>W1</behavior></meta_behavior>
    <behavior name="S1"><config at="/p">/s1</config><inhibition>S2</inhibition></behavior>
    <behavior name="S2"><config at="/p">/s2</config></behavior>
    <behavior name="W1"><config at="/p">/w1</config><inhibition></inhibition></behavior>
    <behavior name="Alone"><config at="/p">/alone</config><inhibition>Weak</inhibition></behavior>
  </behaviors>)");
  EXPECT_THAT(model.codes(), IsEmpty());
  for (const auto& active : subsets({"/s1", "/s2", "/w1", "/alone"})) {
    std::string expected = "-";
    for (const std::string source : {"/w1", "/alone", "/s2", "/s1"}) {
      if (active.contains(source)) expected = source;
    }
    EXPECT_EQ(model.winner("/p", active), expected) << testing::PrintToString(active);
  }
}

TEST(Section4, FollowFaceIsNotAllowedToInhibitRestArm) {
  const auto model = load_text(R"(<behaviors>
    <meta_behavior name="Be Curious"><behavior>Follow Face</behavior></meta_behavior>
    <behavior name="Follow Face"><config at="/Gaze/pos:i">/Face/pos:o</config>
      <inhibition>Rest Arm</inhibition></behavior>
    <behavior name="Rest Arm"><config at="/Arm/pos:i">/RestArm/pos:o</config></behavior>
  </behaviors>)");
  EXPECT_TRUE(model.diagnostics.has_errors());
  ASSERT_EQ(model.diagnostics.items().size(), 1u);
  EXPECT_EQ(model.diagnostics.items()[0].where.line, 4u);
}

TEST(Section4, InhibitionFollowsTheActivityOfTheInhibitorNotItsSelection) {
  const auto model = search_and_track();
  EXPECT_EQ(model.winner(kArm, {kRestArm, kObject, kCollision}), "-");
  EXPECT_EQ(model.winner(kArm, {kRestArm, kCollision}), kRestArm);
}

}  // namespace
}  // namespace arbiter::test
