// Section V, Extracting Rules from Behavioral Model: the rules step by step, and Listing 1.
#include <gmock/gmock.h>

#include "tests/paper/paper_model.hpp"

namespace arbiter::test {
namespace {

using testing::ElementsAre;
using testing::IsEmpty;
using testing::SizeIs;

// As printed, blank "condition" and "inhibition" and all: a list of elements without a root.
const char* const kListing1 = R"(<define name="gaze"> /Gaze/pos:i </define>

<meta_behavior name="Be Curious">
   <behavior>Look Around</behavior>
   <behavior>Follow Face</behavior>
   <condition></condition>
   <inhibition></inhibition>
</meta_behavior>

<behavior name="Look Around">
   <config at="${gaze}">/RandomLook/pos:o</config>
   <condition></condition>
   <inhibition></inhibition>
</behavior>

<behavior name="Follow Face">
   <config at="${gaze}">/Face/pos:o</config>
   <condition></condition>
   <inhibition>Look Around</inhibition>
</behavior>
)";

const char* const kApplication = R"(<application><name>Search and Track</name>
  <module><name>gazeControl</name><node>robot</node></module>
  <connection><from>/RandomLook/pos:o</from><to>/Gaze/pos:i</to></connection>
  <connection><from>/Face/pos:o</from><to>/Gaze/pos:i</to></connection>
  <connection><from>/Object/pos:o</from><to>/Gaze/pos:i</to></connection>
</application>)";

TEST(Section5, Listing1IsAModelAsItStands) {
  const auto model = load_text(kListing1);
  EXPECT_THAT(model.codes(), IsEmpty());
  EXPECT_THAT(model.rules.ports, SizeIs(1));
}

TEST(Section5, LookAroundIsInhibitedByFollowFace) {
  const auto model = load_text(kListing1);
  EXPECT_THAT(model.rules_at(kGaze), ElementsAre("/RandomLook/pos:o ∧ ¬/Face/pos:o", kFace));
}

TEST(Section5, LookAroundIsInhibitedByTrackObjectThroughBeCurious) {
  const auto model = search_and_track();
  EXPECT_EQ(model.rules_at(kGaze).at(0), "/RandomLook/pos:o ∧ ¬/Face/pos:o ∧ ¬/Object/pos:o");
}

TEST(Section5, TheConditionOfTrackObjectIsAddedAtBothArbitrators) {
  const auto model = search_and_track();
  EXPECT_THAT(model.rules_at(kGaze),
              ElementsAre("/RandomLook/pos:o ∧ ¬/Face/pos:o ∧ ¬/Object/pos:o",
                          "/Face/pos:o ∧ ¬/Object/pos:o", "/Object/pos:o ∧ ¬/collision:o"));
  EXPECT_THAT(model.rules_at(kArm),
              ElementsAre("/Object/pos:o ∧ ¬/collision:o", "/RestArm/pos:o ∧ ¬/Object/pos:o"));
}

TEST(Section5, ExtractionTakesTheInheritedConditionsAndThenTheInhibitors) {
  const auto model = load_text(R"(<behaviors>
    <meta_behavior name="M"><behavior>A</behavior><behavior>B</behavior>
      <condition>not /stop:o</condition></meta_behavior>
    <behavior name="A"><config at="/p">/a:o</config><condition>/ready:o</condition></behavior>
    <behavior name="B"><config at="/p">/b:o</config><inhibition>A</inhibition></behavior>
  </behaviors>)");
  for (const auto& active : subsets({"/a:o", "/b:o", "/ready:o", "/stop:o"})) {
    std::string expected = "-";
    if (active.contains("/a:o") && active.contains("/ready:o")) expected = "/a:o";
    if (active.contains("/b:o")) expected = "/b:o";
    if (active.contains("/stop:o")) expected = "-";
    EXPECT_EQ(model.winner("/p", active), expected);
  }
}

// Figure 1: the application is generated from the behaviours and the description of the components.
TEST(Section5, Figure1AnApplicationFileSaysWhichConnectionsExist) {
  const auto model = load_text(kListing1, kApplication);
  EXPECT_THAT(model.codes(), IsEmpty());
  EXPECT_EQ(model.winner(kGaze, {kFace, kRandomLook}), kFace);
  EXPECT_EQ(model.winner(kGaze, {kObject}), "-") << "connected, but no rule selects it";
  EXPECT_EQ(model.winner(kGaze, {kFace, kObject}), kFace);
}

TEST(Section5, AConfiguredConnectionThatTheApplicationLacksIsAnError) {
  const auto model = load_text(
      R"(<behavior name="Rest Arm"><config at="/Arm/pos:i">/RestArm/pos:o</config></behavior>)",
      kApplication);
  EXPECT_TRUE(model.diagnostics.has_errors());
}

// "Based on different behavioral models, the same components can be used for different
// applications."
TEST(Section5, AnotherModelOfTheSameComponentsIsAnotherApplication) {
  const auto shy = load_text(R"(<behaviors>
    <behavior name="Look Away"><config at="/Gaze/pos:i">/RandomLook/pos:o</config>
      <condition>/Face/pos:o</condition></behavior>
  </behaviors>)",
                             kApplication);
  EXPECT_EQ(shy.winner(kGaze, {kFace, kRandomLook}), kRandomLook);
  EXPECT_EQ(shy.winner(kGaze, {kRandomLook}), "-");
}

}  // namespace
}  // namespace arbiter::test
