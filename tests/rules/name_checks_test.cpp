// Names that nobody has: misspelt ones, and declared ones that decide nothing.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <string>
#include <vector>

#include "rules/text/similar_names.hpp"
#include "tests/rules/model_text.hpp"

namespace arbiter::rules {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;

Resemblance resemblance(const std::string& a, const std::string& b) {
  const auto similar = NameIndex({b}).similar_to(a);
  return similar.empty() ? Resemblance::kNone : similar[0].how;
}

TEST(SimilarNames, ASlipInOneWordMakesThemClose) {
  const std::vector<std::pair<const char*, const char*>> close{
      {"/safety/estop:o", "/safety/estopp:o"},   // doubled
      {"/safety/estop:o", "/safety/etop:o"},     // left out
      {"/safety/estop:o", "/safety/esxop:o"},    // replaced
      {"/Gaze/pos:i", "/Gzae/pos:i"},            // exchanged
      {"/safety/estop:o", "/safety/est0p:o"},    // a digit for a letter
      {"/collision:o", "/colisson:o"},           // two slips in a long word
      {"/safety/estop:o", "/safety/e_stop:o"},   // punctuation
      {"/safety/estop:o", "/Safety/EStop:o"},    // case
      {"/safety/estop:o", "/safety/estop"},      // the end left out
      {"/safety/estop:o", "/safety/estop:i"},    // the other end
      {"/safety/estop:o", "/safety/estop:O"},    // the end, in the other case
      {"/safety/estop:o", "/safety/estop:o/"}};  // more behind the end
  for (const auto& [a, b] : close) {
    EXPECT_EQ(resemblance(a, b), Resemblance::kClose) << a << " " << b;
    EXPECT_EQ(resemblance(b, a), Resemblance::kClose) << a << " " << b;
  }
}

TEST(SimilarNames, ShortWordsAndTheEndsOfWordsMayMakeAnotherName) {
  for (const auto& [a, b] :
       std::vector<std::pair<const char*, const char*>>{{"/Walk/cmd:o", "/Talk/cmd:o"},
                                                        {"/wheel:o", "/wheels:o"},
                                                        {"/Arm/pos:o", "/Arm/pose:o"},
                                                        {"/Object/pos:o", "/object_/pso:o"},
                                                        {"/bumper:o", "/bunker:o"}}) {
    EXPECT_EQ(resemblance(a, b), Resemblance::kSlip) << a << " " << b;
  }
}

TEST(SimilarNames, SiblingsAreTwoNames) {
  for (const auto& [a, b] :
       std::vector<std::pair<const char*, const char*>>{{"/Nav1/vel:o", "/Nav2/vel:o"},
                                                        {"/Nav/vel:o", "/Nav2/vel:o"},
                                                        {"/Nav/vel9:o", "/Nav/vel10:o"},
                                                        {"/cell_1_11:o", "/cell_11_1:o"},
                                                        {"/l_arm/pos:o", "/r_arm/pos:o"},
                                                        {"/camA:o", "/camB:o"},
                                                        {"/pad/x:o", "/pad/y:o"},
                                                        {"/Arm/pos:o", "/Arm/vel:o"},
                                                        {"/lock:o", "/unlock:o"},
                                                        {"/left/pos:o", "/right/pos:o"},
                                                        {"/hand/touch:o", "/head/touch:o"},
                                                        {"/Planner/cmd:o", "/Scanner/cmd:o"},
                                                        {"/up:o", "/on:o"}}) {
    EXPECT_EQ(resemblance(a, b), Resemblance::kNone) << a << " " << b;
  }
}

TEST(SimilarNames, ANamespaceMoreOrLessMayMakeAnotherName) {
  for (const auto& [a, b] : std::vector<std::pair<const char*, const char*>>{
           {"/estop:o", "/robot1/estop:o"},
           {"/estop:o", "/site/robot1/estop:o"},
           {"/robot1/estop:o", "/robot1/safety/estop:o"},
           {"/robot1/safety/estop:o", "/robot1/base/safety/estop:O"}}) {
    EXPECT_EQ(resemblance(a, b), Resemblance::kSlip) << a << " " << b;
    EXPECT_EQ(resemblance(b, a), Resemblance::kSlip) << a << " " << b;
  }
  for (const auto& [a, b] : std::vector<std::pair<const char*, const char*>>{
           {"/robot1/estop:o", "/robot2/safety/estop:o"},
           {"/robot1/base:o", "/robot1/base/cmd:o"},
           {"/estop:o", "/robot1/stop:o"},
           {"/a/b/c:o", "/a/x/y/b/c:o"},
           {"/left/estop:o", "/right/estop:o"}}) {
    EXPECT_EQ(resemblance(a, b), Resemblance::kNone) << a << " " << b;
    EXPECT_EQ(resemblance(b, a), Resemblance::kNone) << a << " " << b;
  }
}

TEST(SimilarNames, ComparingLongNamesOfOnePatternHasABound) {
  const std::string one = "/" + std::string(100, 'a') + ":o";
  const std::string other = "/" + std::string(99, 'a') + "b:o";
  NameIndex enough({one, other}, 1000);
  EXPECT_EQ(enough.similar_to(one).size(), 1U);
  EXPECT_FALSE(enough.is_exhausted());
  NameIndex less({one, other}, 100);
  EXPECT_THAT(less.similar_to(one), IsEmpty());
  EXPECT_TRUE(less.is_exhausted());
}

TEST(NameChecks, AnEmergencyStopUnderTwoNamesIsToldAtBoth) {
  const Loaded loaded = load_text(
      "<behaviors>\n"
      "  <source port='/safety/estop:o' timeout='1s'/>\n"
      "  <behavior name='Drive'><config at='/Base/vel:i'>/Nav/vel:o</config>\n"
      "    <condition>not /safety/estopp:o</condition></behavior>\n"
      "</behaviors>");
  EXPECT_FALSE(loaded.has_errors);
  EXPECT_THAT(loaded.findings(),
              ElementsAre("2:3 warning never-read", "4:20 warning similar-name"));
  EXPECT_THAT(loaded.message(0), HasSubstr("no rule reads or selects /safety/estop:o"));
  EXPECT_THAT(loaded.message(0), HasSubstr("did you mean it where /safety/estopp:o is written, "));
  EXPECT_THAT(loaded.message(0), HasSubstr("a.xml:4:20?"));
  EXPECT_THAT(loaded.message(1), HasSubstr("the name /safety/estopp:o stands only here"));
  EXPECT_THAT(loaded.message(1), HasSubstr("did you mean /safety/estop:o, as at "));
  EXPECT_THAT(loaded.message(1), HasSubstr("a.xml:2:17?"));
}

TEST(NameChecks, ADeclaredSourceMustBeReadOrSelected) {
  EXPECT_THAT(load_text("<behaviors><source port='/a:o'/><source port='/b:o'/>"
                        "<source port='/c:o'/><source port='/far/away:o'/>"
                        "<arbiter at='/p:i'><select from='/a:o'>not /b:o and none(/c*)</select>"
                        "</arbiter></behaviors>")
                  .findings(),
              ElementsAre("1:75 warning never-read"));
}

// One behaviour that reads `condition`, and drives from /Nav/vel:o.
Loaded load_condition(const std::string& condition, const std::string& more = "") {
  return load_text("<behaviors>" + more +
                   "<behavior name='B'><config at='/Base/vel:i'>/Nav/vel:o</config>\n<condition>" +
                   condition + "</condition></behavior></behaviors>");
}

TEST(NameChecks, ANameThatStandsInSeveralPlacesIsMeant) {
  const std::string declared = "<source port='/estop:o'/>";
  EXPECT_THAT(load_condition("not /estop:o and not /estopp:o", declared).findings(),
              ElementsAre("2:33 warning similar-name"));
  EXPECT_THAT(
      load_condition("not /estop:o and not /estopp:o and not /estopp:o", declared).findings(),
      IsEmpty());
  EXPECT_THAT(
      load_condition("not /estop:o and not /estopp:o", declared + "<source port='/estopp:o'/>")
          .findings(),
      IsEmpty());
}

TEST(NameChecks, OfTwoThatStandInOnePlaceEachTheLaterOneIsTold) {
  const Loaded loaded = load_condition("not /collision:o and not /colision:o");
  EXPECT_THAT(loaded.findings(), ElementsAre("2:37 warning similar-name"));
  EXPECT_THAT(loaded.message(), HasSubstr("did you mean /collision:o, as at "));
}

TEST(NameChecks, WhatIsOnlyReadIsTheLikelierMistake) {
  const Loaded loaded = load_text(
      "<behaviors><behavior name='A'><config at='/p:i'>/Track/pos:o</config>\n"
      "<condition>not /Trakc/pos:o</condition></behavior></behaviors>");
  EXPECT_THAT(loaded.findings(), ElementsAre("2:16 warning similar-name"));
  const Loaded reversed = load_text(
      "<behaviors><behavior name='Z'><config at='/p:i'>/far:o</config>\n"
      "<condition>not /Trakc/pos:o</condition></behavior>\n"
      "<behavior name='A'><config at='/q:i'>/Track/pos:o</config></behavior></behaviors>");
  EXPECT_THAT(reversed.findings(), ElementsAre("2:16 warning similar-name"));
}

// A short slip of what nothing vouches for is told; of two that are connected it is not.
TEST(NameChecks, TwoConnectedNamesAreTwoNamesUnlessTheyAreVeryClose) {
  const auto both = [](const std::string& a, const std::string& b) {
    return load_text("<behaviors><behavior name='A'><config at='/p:i'>" + a +
                     "</config></behavior>\n<behavior name='B'><config at='/q:i'>" + b +
                     "</config></behavior></behaviors>")
        .findings();
  };
  EXPECT_THAT(both("/Walk/cmd:o", "/Talk/cmd:o"), IsEmpty());
  EXPECT_THAT(both("/Object/pos:o", "/Objct/pos:o"), ElementsAre("2:38 warning similar-name"));
  EXPECT_THAT(load_condition("not /Nvv/vel:o").findings(), IsEmpty());
  EXPECT_THAT(load_condition("not /Nva/vel:o").findings(),
              ElementsAre("2:16 warning similar-name"));
}

TEST(NameChecks, InputPortsHaveNamesToo) {
  EXPECT_THAT(load_text("<behaviors>\n"
                        "<behavior name='A'><config at='/Gaze/pos:i'>/a:o</config></behavior>\n"
                        "<behavior name='B'><config at='/Gzae/pos:i'>/b:o</config></behavior>\n"
                        "</behaviors>")
                  .findings(),
              ElementsAre("3:32 warning similar-name"));
}

TEST(NameChecks, ADefineIsOnePlaceHoweverOftenItIsUsed) {
  const Loaded loaded =
      load_condition("not ${stop} and (not ${stop} or not ${stop})",
                     "<source port='/estop:o'/><define name='stop'>/estopp:o</define>");
  EXPECT_THAT(loaded.findings(),
              ElementsAre("1:12 warning never-read", "2:16 warning similar-name"));
  EXPECT_THAT(loaded.message(1), HasSubstr("stands only here (in the text of ${stop}), and"));
}

TEST(NameChecks, TheApplicationKnowsNamesAndItsOwnAreNotJudged) {
  const std::string model =
      "<behaviors><behavior name='B'><config at='/Base/vel:i'>/Nav/vel:o</config>\n"
      "<condition>not /estopp:o</condition></behavior></behaviors>";
  const auto with = [&](const std::string& connections) {
    return load_with_application(
               model,
               "<application><connection><from>/Nav/vel:o</from><to>/Base/vel:i</to></connection>" +
                   connections + "</application>")
        .findings();
  };
  EXPECT_THAT(with(""), IsEmpty());
  EXPECT_THAT(with("<connection><from>/estop:o</from><to>/log:i</to></connection>"
                   "<connection><from>/nightly:o</from><to>/log:i</to></connection>"
                   "<connection><from>/nigthly:o</from><to>/log:i</to></connection>"),
              ElementsAre("2:16 warning similar-name", "1:143 note not-arbitrated"));
}

// What it calls so, nobody may write in a model.
TEST(NameChecks, AnApplicationsNameThatLacksItsSlashIsToBeCorrectedThere) {
  const Loaded loaded = load_with_application(
      "<behaviors><behavior name='B'><config at='/Base/vel:i'>/Nav/vel:o</config>\n"
      "<condition>not /estop:o</condition></behavior></behaviors>",
      "<application><module><prefix>/Nav</prefix></module>"
      "<connection><from>/Nav/vel:o</from><to>/Base/vel:i</to></connection>"
      "<connection><from>estop:o</from><to>/log:i</to></connection></application>");
  EXPECT_THAT(loaded.findings(),
              ElementsAre("2:1 warning never-published", "2:16 warning similar-name"));
  EXPECT_THAT(loaded.message(0),
              HasSubstr("; put a slash in front of \"estop:o\" in the application"));
  EXPECT_THAT(loaded.message(1), HasSubstr("is estop:o, without a slash in front: put one there"));
}

// It may have been the very name that is missing.
TEST(NameChecks, AreNotAskedWhereANameMayHaveBeenRefused) {
  EXPECT_THAT(load_condition("not /estopp:o and", "<source port='/estop:o'/>").findings(),
              ElementsAre("2:29 error malformed-condition"));
}

TEST(NameChecks, AreAskedBesideErrorsThatTakeNoNameAway) {
  EXPECT_THAT(
      load_condition("not /estopp:o", "<source port='/estop:o' timeout='5 parsecs'/>").findings(),
      ElementsAre("1:45 error invalid-timeout", "2:16 warning similar-name"));
}

TEST(NameChecks, WhatIsOnlyReadAndLacksTheNamespaceIsTold) {
  const Loaded loaded = load_text(
      "<behaviors><source port='/r1/estop:o'/><source port='/r2/estop:o'/>\n"
      "<behavior name='A'><config at='/r1/p:i'>/r1/nav:o</config>"
      "<condition>not /r1/estop:o</condition></behavior>\n"
      "<behavior name='B'><config at='/r2/p:i'>/r2/nav:o</config>"
      "<condition>not /estop:o</condition></behavior></behaviors>");
  EXPECT_THAT(loaded.findings(),
              ElementsAre("1:40 warning never-read", "3:74 warning similar-name"));
  EXPECT_THAT(loaded.message(1), HasSubstr("did you mean /r2/estop:o, as at "));
}

TEST(NameChecks, OfSeveralTheOneThatIsDeclaredIsMeant) {
  const Loaded loaded = load_condition("/Estop:o and not /e/stop:o", "<source port='/estop:o'/>");
  EXPECT_THAT(loaded.findings(), ElementsAre("1:12 warning never-read", "2:12 warning similar-name",
                                             "2:29 warning similar-name"));
  EXPECT_THAT(loaded.message(1), HasSubstr("did you mean /estop:o, as at "));
  EXPECT_THAT(loaded.message(2), HasSubstr("did you mean /estop:o, as at "));
}

TEST(NameChecks, APatternWhereANameBelongsIsTold) {
  const Loaded read = load_condition("not \"/Op/*\" and none(/Op/*)");
  EXPECT_THAT(read.findings(), ElementsAre("2:16 warning pattern-as-name"));
  EXPECT_THAT(read.message(),
              HasSubstr("/Op/* is the name of one port here: only any(…), all(…) "));
  EXPECT_THAT(load_text("<behaviors><behavior name='B'><config at='/Arm/*'>/Nav/*:o</config>"
                        "</behavior></behaviors>")
                  .findings(),
              testing::UnorderedElementsAre("1:43 warning pattern-as-name",
                                            "1:51 warning pattern-as-name"));
}

TEST(NameChecks, ASourceThatIsAnInputPortIsToldAndTheOtherWayRound) {
  const Loaded read = load_condition("not /Base/vel:i");
  EXPECT_THAT(read.findings(), ElementsAre("2:16 warning wrong-end"));
  EXPECT_THAT(read.message(), HasSubstr("/Base/vel:i stands here as a source, and as an input "
                                        "port at "));
  EXPECT_THAT(load_condition("not /Far:i").findings(), ElementsAre("2:16 warning wrong-end"));
  const Loaded exchanged = load_text(
      "<behaviors><behavior name='B'><config at='/Nav/vel:o'>/Base/vel:i</config></behavior>\n"
      "<behavior name='C'><config at='/Base/vel:i'>/Rest/vel:o</config></behavior></behaviors>");
  EXPECT_THAT(exchanged.findings(),
              ElementsAre("1:43 warning wrong-end", "1:55 warning wrong-end"));
  EXPECT_THAT(exchanged.message(0), HasSubstr("/Nav/vel:o stands here as an input port, but is "));
  // Who has no such endings is judged by what he does with the names.
  EXPECT_THAT(load_text("<behaviors><behavior name='B'><config at='/base'>/nav</config></behavior>"
                        "<behavior name='C'><config at='/arm'>/base</config></behavior>"
                        "</behaviors>")
                  .findings(),
              ElementsAre("1:111 warning wrong-end"));
}

// The one that stands at the wrong end is told, and not proposed for the one that does not.
TEST(NameChecks, ANameAtTheWrongEndIsNoneThatAnotherMeant) {
  const Loaded read = load_text(
      "<behaviors><behavior name='B'><config at='/Arm/pos:i'>/Reach/pos:o</config>\n"
      "<condition>not /Reach/pos:i</condition></behavior></behaviors>");
  EXPECT_THAT(read.findings(),
              testing::UnorderedElementsAre("2:16 warning similar-name", "2:16 warning wrong-end"));
  const Loaded two = load_condition("not /safety/estop:i and not /safety/estop:o");
  EXPECT_THAT(two.findings(), ElementsAre("2:16 warning wrong-end"));
  const Loaded port = load_text(
      "<behaviors><behavior name='B'><config at='/Gripper/pos:o'>/Reach/pos:o</config></behavior>\n"
      "<behavior name='C'><config at='/Gripper/pos:i'>/Rest/pos:o</config></behavior></behaviors>");
  EXPECT_THAT(port.findings(), ElementsAre("1:43 warning wrong-end"));
}

TEST(NameChecks, ADeclarationToCopyIsXml) {
  const Loaded read = load_text(
      "<behaviors><source port='/R&amp;D/estop:o'/><behavior name='B'>"
      "<config at='/Arm/pos:i'>/Reach/pos:o</config>\n"
      "<condition>not \"/R&amp;D/estop:o\" and not \"/R&amp;D/estpo:o\"</condition>"
      "</behavior></behaviors>");
  EXPECT_THAT(read.message(), HasSubstr("with <source port=\"/R&amp;D/estpo:o\"/>"));
}

TEST(NameChecks, LargeModelsOfSiblingsAreQuiet) {
  std::string model = "<behaviors>\n";
  for (int i = 0; i < 60; ++i) {
    const std::string n = std::to_string(i);
    model += "<behavior name='B" + n + "'><config at='/joint" + n + "/vel:i'>/Nav" + n +
             "/vel:o</config><condition>not /bumper" + n + "/left:o and not /bumper" + n +
             "/right:o and not /cell_" + n + "_1:o</condition></behavior>\n";
  }
  EXPECT_THAT(load_text(model + "</behaviors>").findings(), IsEmpty());
}

}  // namespace
}  // namespace arbiter::rules
