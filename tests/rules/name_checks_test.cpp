// Names that nobody has: misspelt ones, and declared ones that decide nothing.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <string>
#include <vector>

#include "rules/similar_names.hpp"
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
      {"/safety/estop:o", "/safety/estopp:o"},  // doubled
      {"/safety/estop:o", "/safety/etop:o"},    // left out
      {"/safety/estop:o", "/safety/esxop:o"},   // replaced
      {"/Gaze/pos:i", "/Gzae/pos:i"},           // exchanged
      {"/safety/estop:o", "/safety/est0p:o"},   // a digit for a letter
      {"/collision:o", "/colisson:o"},          // two slips in a long word
      {"/safety/estop:o", "/safety/e_stop:o"},  // punctuation
      {"/safety/estop:o", "/Safety/EStop:o"},   // case
      {"/safety/estop:o", "/safety/estop"},     // the end left out
      {"/safety/estop:o", "/safety/estop:i"}};  // the other end
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
              ElementsAre("2:16 warning similar-name"));
}

TEST(NameChecks, AreNotAskedOfAModelWithErrors) {
  EXPECT_THAT(load_condition("not /estopp:o and", "<source port='/estop:o'/>").findings(),
              ElementsAre("2:29 error malformed-condition"));
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

TEST(ForeverCommands, ASourceThatCommandsForeverIsNoted) {
  const Loaded loaded = load_text(
      "<behaviors>\n<source port='/Lock:o' timeout='forever'/>\n"
      "<source port='/Hold/pos:o' timeout='forever'/>\n"
      "<behavior name='A'><config at='/p:i'>/Hold/pos:o</config>"
      "<config at='/q:i'>/Hold/pos:o</config><condition>not /Lock:o</condition></behavior>\n"
      "</behaviors>");
  EXPECT_THAT(loaded.findings(), ElementsAre("3:1 note forever-commands"));
  EXPECT_THAT(loaded.message(), HasSubstr("/Hold/pos:o commands /p:i and /q:i, and its T is "
                                          "forever: if its process is killed, "));
  EXPECT_THAT(loaded.message(), HasSubstr("; give it a finite T, or "));
}

TEST(ForeverCommands, SourcesThatHaveItByDefaultAreNotedTogether) {
  const Loaded loaded = load_text(
      "<behaviors timeout='forever'>\n<source port='/c:o' timeout='1s'/>\n"
      "<behavior name='A'><config at='/p:i'>/a:o</config></behavior>\n"
      "<behavior name='B'><config at='/q:i'>/b:o</config></behavior>\n"
      "<behavior name='C'><config at='/r:i'>/c:o</config></behavior>\n</behaviors>");
  EXPECT_THAT(loaded.findings(), ElementsAre("1:21 note forever-commands"));
  EXPECT_THAT(loaded.message(), HasSubstr("/a:o and /b:o command /p:i and /q:i, and their T is "));
}

}  // namespace
}  // namespace arbiter::rules
